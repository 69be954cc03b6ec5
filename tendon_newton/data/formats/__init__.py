"""Files that hold recordings: CSV, MCAP and ROS 2 bags, with the load cell brought to the rows."""
