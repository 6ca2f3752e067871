"""Drivers: ROS 2 (through rclpy, or DDS alone), and a vendor's hand."""
