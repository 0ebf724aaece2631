"""What every node that moves the robot needs of its driver's topics: checks, ages, messages."""
