"""What gyro, accelerometer and encoders can know of a row turn at all, and how far the filters are from it."""
