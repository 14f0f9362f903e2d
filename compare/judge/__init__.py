"""A law held against the grains in the grains' own flow, before any collapse is computed."""
