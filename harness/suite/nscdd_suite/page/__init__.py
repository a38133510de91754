"""The page of a folder of results: its blocks and frame, and what the sections of several studies share."""
