"""When an effect began in the drive: its size by window, and the change of that size that the windows ask for."""
