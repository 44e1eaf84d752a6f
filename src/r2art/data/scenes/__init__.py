"""What is photographed: an object with its surroundings, light and viewpoint."""
