//! Readers and writers of file formats.

mod authors_txt;
mod bvh_read;
mod bvh_write;
mod frames;
mod joint_names;
mod joints_description;
mod keypoints_npz;
mod motion_file;
mod smplx;
mod smplx_verb;
mod subtitles;
mod transcript;
mod transcript_write;
mod unit;
mod wav;
