/* Stand-in, see hal.h. */
