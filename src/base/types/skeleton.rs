//! The 49-joint skeleton of Rebol et al. 2021 in the joint order of this project: neck, right arm, left arm, left
//! hand, right hand; a hand is its wrist, then thumb, index, middle, ring, little finger, each from BASE TO TIP (the
//! OpenPose / MediaPipe order). The authors' text files list each finger from the tip; `swap_authors_order` converts
//! between the two orders and is its own inverse.

pub const N_JOINTS: usize = 49;
/// Number of joints of a hand, including its root, which duplicates the wrist.
pub const N_HAND_JOINTS: usize = 21;
/// Number of bones: every joint except the neck has one, to its parent.
pub const N_BONES: usize = N_JOINTS - 1;

pub const NECK: usize = 0;
pub const R_SHOULDER: usize = 1;
pub const R_ELBOW: usize = 2;
pub const R_WRIST: usize = 3;
pub const L_SHOULDER: usize = 4;
pub const L_ELBOW: usize = 5;
pub const L_WRIST: usize = 6;
/// Root of the left hand; always equal to `L_WRIST`.
pub const L_HAND: usize = 7;
/// Root of the right hand; always equal to `R_WRIST`.
pub const R_HAND: usize = 28;

/// Bones of the arms as pairs of joints: upper arms, then forearms, right before left.
pub const ARM_BONES: [(usize, usize); 4] =
    [(R_SHOULDER, R_ELBOW), (L_SHOULDER, L_ELBOW), (R_ELBOW, R_WRIST), (L_ELBOW, L_WRIST)];
/// The shoulder line, then `ARM_BONES`: the bones that determine the scale of a body.
pub const BODY_BONES: [(usize, usize); 5] =
    [(R_SHOULDER, L_SHOULDER), ARM_BONES[0], ARM_BONES[1], ARM_BONES[2], ARM_BONES[3]];
/// Shoulder, elbow and wrist of the right and the left arm.
pub const ARMS: [[usize; 3]; 2] = [[R_SHOULDER, R_ELBOW, R_WRIST], [L_SHOULDER, L_ELBOW, L_WRIST]];

/// Side of the speaker's body that a joint belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Centre,
    Left,
    Right,
}

const FINGERS: [&str; 5] = ["Thumb", "Index", "Middle", "Ring", "Little"];
const PHALANGES: [&str; 4] = ["Base", "Inter", "Distal", "Tip"];

/// Returns the parent of a joint; `None` for the neck.
pub const fn parent(joint: usize) -> Option<usize> {
    match joint {
        NECK => None,
        R_SHOULDER | L_SHOULDER => Some(NECK),
        R_ELBOW | R_WRIST | L_ELBOW | L_WRIST => Some(joint - 1),
        L_HAND => Some(L_WRIST),
        R_HAND => Some(R_WRIST),
        _ => {
            let root = if joint < R_HAND { L_HAND } else { R_HAND };
            if (joint - root) % 4 == 1 { Some(root) } else { Some(joint - 1) }
        }
    }
}

pub const fn side(joint: usize) -> Side {
    match joint {
        NECK => Side::Centre,
        R_SHOULDER..=R_WRIST => Side::Right,
        L_SHOULDER..R_HAND => Side::Left,
        _ => Side::Right,
    }
}

/// Returns whether the joint is the root of a hand, which duplicates the wrist.
pub const fn is_duplicate(joint: usize) -> bool {
    joint == L_HAND || joint == R_HAND
}

/// Returns the name of a joint, for instance `RWrist`, `LIndexTip`.
pub fn name(joint: usize) -> String {
    const BODY: [&str; 7] = ["Neck", "RShoulder", "RElbow", "RWrist", "LShoulder", "LElbow", "LWrist"];
    if joint < L_HAND {
        return BODY[joint].to_owned();
    }
    let (side, root) = if joint < R_HAND { ("L", L_HAND) } else { ("R", R_HAND) };
    match joint - root {
        0 => format!("{side}HandRoot"),
        k => format!("{side}{}{}", FINGERS[(k - 1) / 4], PHALANGES[(k - 1) % 4]),
    }
}

/// Returns the corresponding joint on the other side of the body.
pub const fn mirror(joint: usize) -> usize {
    match joint {
        NECK => NECK,
        R_SHOULDER..=R_WRIST => joint + 3,
        L_SHOULDER..=L_WRIST => joint - 3,
        L_HAND..R_HAND => joint + 21,
        _ => joint - 21,
    }
}

/// Converts a joint index between the joint order of this project and that of the authors, in both directions, by
/// reversing each finger: `joints[j] = authors[swap_authors_order(j)]`.
pub const fn swap_authors_order(joint: usize) -> usize {
    if joint < L_HAND {
        return joint;
    }
    let root = if joint < R_HAND { L_HAND } else { R_HAND };
    if joint == root {
        return joint;
    }
    let k = joint - root - 1;
    root + 1 + 4 * (k / 4) + (3 - k % 4)
}
