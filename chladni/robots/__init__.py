"""Robots as their users have them: descriptions (MJCF, URDF, robot files) and the logs of their joints."""
