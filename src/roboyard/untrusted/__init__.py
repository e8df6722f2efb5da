"""Files and texts that others wrote: bounded before they are read, and escaped before they are printed."""
