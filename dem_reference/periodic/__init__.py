"""Grains in a box without walls, whose faces are periodic: what the element tests are made of."""
