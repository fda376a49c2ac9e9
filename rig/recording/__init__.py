"""Records of received data with their arrival times, and the file that stores them."""
