"""Tasks on the workers of Dask: each is done once, in a folder of its own that is there when it is whole."""
