//! Stage 2: frames to 2D keypoints of the one speaker: person box, body, both hands, followed through each shot.
