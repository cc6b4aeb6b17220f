//! `orator study serve`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_study::folder::StudyFolder;
use orator_study::server::start::StudyServer;
use serde_json::json;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

/// Serve a built study to its participants until Ctrl-C.
///
/// Answers are stored in DIR/responses.sqlite, each before it is acknowledged; a server that was stopped or killed goes on
/// where it was. No address of a participant and no trace of a browser is stored. The server speaks HTTP: for participants
/// elsewhere put it behind a proxy with a certificate (caddy, nginx) on the same machine.
#[derive(clap::Args)]
pub struct Args {
    /// The study's folder.
    #[arg(value_name = "DIR")]
    dir: PathBuf,
    /// Address to listen at; others than this machine reach it only if it is not a loopback address.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    listen: IpAddr,
    /// Port to listen at; 0: any that is free.
    #[arg(long, default_value_t = 8080)]
    port: u16,
    /// Minutes without an answer after which a participant's place is given to another.
    #[arg(long, value_name = "MINUTES", default_value_t = 60)]
    abandoned_after: u32,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let folder = StudyFolder::new(&args.dir);
    let abandoned_secs = 60.0 * f64::from(args.abandoned_after);
    let server = StudyServer::open(&folder, abandoned_secs)?;
    let title = server.study().title.clone();
    let counts = format!("{} sessions, {} films", server.study().plan.sessions.len(), server.study().n_films());
    let token = server.operator_token().to_owned();
    server.run(SocketAddr::new(args.listen, args.port), |address| {
        let page = format!("http://{address}/");
        let text = format!("{title}: {counts}\nparticipants: {page}\noperator:     {page}operator, token {token}");
        let facts = json!({ "address": page, "operator_address": format!("{page}operator"), "operator_token": token });
        ui.summary(&text, None, facts);
    })?;
    Ok(Outcome::Done)
}
