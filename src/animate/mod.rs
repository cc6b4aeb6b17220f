//! Joints to rotations, and the files people open: BVH, MP4.
