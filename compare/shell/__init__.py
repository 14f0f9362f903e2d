"""What a shell and `man` know of the launcher, made of its parsers."""
