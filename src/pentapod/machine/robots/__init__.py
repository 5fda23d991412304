"""The robot families of machine files: a file each, with its keys of [geometry]."""
