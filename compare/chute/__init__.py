"""A layer that flows down a plane: profiles of both sides over its depth, once it is steady."""
