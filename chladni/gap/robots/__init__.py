"""Why a robot and its description disagree: by the torque that its motion needs, then by simulating it."""
