"""Posts: files of a program for controllers and other software; writer and reader of a format in one file."""

from pentapod.program.posts import csv, drives, hdf5, linuxcnc, npz, ros, simulators, toolpaths
from pentapod.program.posts.registry import (
    POSTS,
    Post,
    PostInput,
    find_post,
    post_names,
    read_post,
    register,
    write_post,
)
from pentapod.program.posts.tables import Column, Table, leg_columns, table_post
from pentapod.program.posts.toolpaths import placed_toolpath

__all__ = [
    "POSTS",
    "Column",
    "Post",
    "PostInput",
    "Table",
    "csv",
    "drives",
    "find_post",
    "hdf5",
    "leg_columns",
    "linuxcnc",
    "npz",
    "placed_toolpath",
    "post_names",
    "read_post",
    "register",
    "ros",
    "simulators",
    "table_post",
    "toolpaths",
    "write_post",
]
