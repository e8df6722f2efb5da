"""Writers: each translates an imported robot into one file format and decides nothing."""
