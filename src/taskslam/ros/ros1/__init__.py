"""ROS 1, spoken by ourselves: a master and TCPROS over the standard library and the codecs of rosbags."""
