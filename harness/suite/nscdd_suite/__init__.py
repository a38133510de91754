"""The suite: studies that run the program, record what they find, and draw the page."""
