"""r2art for ROS 2: images in; detections, joint states and frames out.

settings   the node's parameters
images     sensor_msgs/Image and CompressedImage to photos
cameras    sensor_msgs/CameraInfo to cameras
pairing    images and camera_info of one moment
results    predictions to messages
estimate   all of that in one function
node       the only module that knows rclpy
"""
