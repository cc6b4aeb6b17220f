//! Stage 3: keypoints to intervals worth keeping; every refused stretch with its reason and measured value.
