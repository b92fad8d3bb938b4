"""What can be read off the frames: colours, shapes, motions, nozzles."""
