//! Gallery of the site: shell commands that write pictures, films and pages from the folder of the demo.

use super::site::GALLERY;
use anyhow::{Context, Result, ensure};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use orator_report::html::{Node, node};
use std::path::Path;
use std::process::{Command, Stdio};

/// Picture with the command that makes it.
pub struct GalleryItem {
    pub anchor: &'static str,
    pub title: &'static str,
    pub text: &'static str,
    /// Shell command, run in the folder of the demo; it writes into the folder `$GALLERY`.
    pub command: &'static str,
    /// Picture (.png or .jpg) that the page shows; empty: none.
    pub picture: &'static str,
    /// Film or page that the page links to; empty: none.
    pub link: &'static str,
}

/// The gallery of `make demo`.
pub static ITEMS: [GalleryItem; 3] = [
    GalleryItem {
        anchor: "contact-sheet",
        title: "Contact sheet",
        text: "A video of the synthetic speaker, detected keypoints, lifted joints, and motion generated from its \
                  speech.",
        command: "orator-lab demo sheet . --motion motion.npy --out \"$GALLERY/contact_sheet.png\"",
        picture: "contact_sheet.png",
        link: "",
    },
    GalleryItem {
        anchor: "film",
        title: "Lifted motion",
        text: "The avatar, with the motion lifted from the video beside it.",
        command: "orator animate work/lift/host/clip-1-???????? --compare videos/host/clip-1.mp4 \\\n    \
                  --out \"$GALLERY/film.mp4\"\n\
                  ffmpeg -v error -y -ss 2 -i \"$GALLERY/film.mp4\" -frames:v 1 \"$GALLERY/film.jpg\"",
        picture: "film.jpg",
        link: "film.mp4",
    },
    GalleryItem {
        anchor: "evaluation",
        title: "Evaluation",
        text: "A page that plays generated and true motion side by side, with metrics and conclusions.",
        command: "orator evaluate --dataset work/dataset/host --checkpoint work/gan/host --split test \\\n    \
                  --report \"$GALLERY/evaluation.html\"",
        picture: "",
        link: "evaluation.html",
    },
];

/// Runs the commands of `items` in the folder `demo`; their files are written into `folder`.
///
/// # Errors
/// A command fails.
pub fn make(items: &[GalleryItem], demo: &Path, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let folder = std::path::absolute(folder)?;
    let program = std::env::current_exe()?;
    let programs = program.parent().map(Path::to_owned);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(programs.into_iter().chain(std::env::split_paths(&path)))?;
    for item in items {
        let mut command = Command::new("sh");
        command.args(["-euc", item.command]).current_dir(demo).env("GALLERY", &folder).env("PATH", &path);
        let status = command.stdin(Stdio::null()).stdout(Stdio::null()).status().context("cannot run sh")?;
        ensure!(status.success(), "{}, in {}: {status}", item.command, demo.display());
    }
    Ok(())
}

impl GalleryItem {
    /// Section of the page; the picture in `folder` is embedded.
    ///
    /// # Errors
    /// The picture cannot be read.
    pub fn section(&self, folder: &Path) -> Result<Node> {
        let command = node("pre").attr("tabindex", 0).child(node("code").text(self.command));
        let mut section = node("section")
            .child(node("h2").id(self.anchor).text(self.title))
            .child(node("p").text(self.text))
            .child(command);
        if !self.picture.is_empty() {
            let path = folder.join(self.picture);
            let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            let kind = if self.picture.ends_with(".png") { "png" } else { "jpeg" };
            let source = format!("data:image/{kind};base64,{}", STANDARD.encode(bytes));
            section = section.child(node("p").child(node("img").attr("src", source).attr("alt", self.text)));
        }
        if !self.link.is_empty() {
            let target = format!("{GALLERY}/{}", self.link);
            section = section.child(node("p").child(node("a").attr("href", target).text(self.link)));
        }
        Ok(section)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_makes_the_picture_of_its_section() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("site/gallery");
        let item = |command| GalleryItem {
            anchor: "a",
            title: "A",
            text: "of & a",
            command,
            picture: "a.png",
            link: "a.html",
        };
        std::fs::write(dir.path().join("motion"), "picture").unwrap();
        let made = item("cp motion \"$GALLERY/a.png\"");
        assert!(made.section(&folder).is_err());
        make(std::slice::from_ref(&made), dir.path(), &folder).unwrap();
        let html = made.section(&folder).unwrap().to_string();
        assert!(html.contains("<img src=\"data:image/png;base64,cGljdHVyZQ==\" alt=\"of &amp; a\">"), "{html}");
        assert!(html.contains("cp motion &quot;$GALLERY/a.png&quot;") && html.contains("href=\"gallery/a.html\""));
        let error = make(&[item("cp none \"$GALLERY\"")], dir.path(), &folder).unwrap_err();
        assert!(error.to_string().starts_with("cp none"), "{error}");
    }
}
