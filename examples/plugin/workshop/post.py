"""A post: one line for each setpoint, the time in milliseconds and the legs in micrometres."""

from pentapod.program.posts import Column, Table, leg_columns, table_post

_COLUMNS = (Column("t", "time", "ms", 3), *leg_columns("L{leg}", "length", "um", 5))

POST = table_post("drives-ms", "the workshop's drives", Table({"legs.txt": _COLUMNS}, separator=";", comment="%"))
