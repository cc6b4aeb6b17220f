//! The container file names the libraries that the program links.

use std::process::Command;

#[test]
fn the_containerfile_has_the_packages_of_all_linked_libraries() {
    let file = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/.ci/Containerfile")).unwrap();
    let output = |program: &str, argument: &str| {
        let output =
            Command::new(program).arg(if program == "dpkg" { "-S" } else { "--" }).arg(argument).output().ok()?;
        Some(String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (Some(linked), Some(_)) = (output("ldd", env!("CARGO_BIN_EXE_orator")), output("dpkg", "libc.so.6")) else {
        return orator_test_support::skip::skip("no ldd and dpkg");
    };
    let is_media_library =
        |line: &&str| ["libav", "libsw", "libopencv"].iter().any(|name| line.trim_start().starts_with(name));
    let paths: Vec<&str> =
        linked.lines().filter(is_media_library).filter_map(|line| line.split_whitespace().nth(2)).collect();
    assert!(paths.len() >= 6, "{linked}");
    for path in paths {
        let name = path.rsplit('/').next().unwrap();
        let package = output("dpkg", &format!("*/{name}")).unwrap();
        let package = package.split(':').next().unwrap().trim().to_owned();
        // libavutil comes with libavcodec.
        assert!(package.starts_with("libavutil") || file.contains(&package), "{name} is in {package}");
    }
}
