//! Stage 4: 2D keypoints to 3D joints: body, hands, joined, bone lengths, smoothing.
