//! A study's server from its folder to its end.

use super::app::App;
use super::limits::RateLimits;
use super::listen;
use super::router::router;
use super::secret::StudySecret;
use super::served::ServedStudy;
use crate::folder::StudyFolder;
use crate::seal::StudySeal;
use crate::store::writer::ResponseStore;
use anyhow::{Context, Result};
use std::net::SocketAddr;
use std::path::Path;
use std::thread::JoinHandle;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};

/// Server of one study, not listening yet.
pub struct StudyServer {
    app: App,
    writer: JoinHandle<()>,
}

impl StudyServer {
    /// Opens the study in `folder`, its responses and its secret. `abandoned_secs`: time without an answer after which a
    /// place is given again. `operator_token`: file with the operator's token, in place of the one made.
    ///
    /// # Errors
    /// A study that is not as it was sealed, or whose secret or responses are not its own.
    pub fn open(folder: &StudyFolder, abandoned_secs: f64, operator_token: Option<&Path>) -> Result<Self> {
        StudySeal::verify(folder)?;
        let study = ServedStudy::open(folder, abandoned_secs)?;
        let mut secret = StudySecret::open(&folder.secret())?;
        operator_token.map_or(Ok(()), |file| secret.set_operator_token(file))?;
        let (store, writer) = ResponseStore::open(&folder.responses(), &study.plan_hash)?;
        Ok(Self { app: App { study, store, secret, limits: RateLimits::new() }, writer })
    }

    pub fn study(&self) -> &ServedStudy {
        &self.app.study
    }

    pub fn operator_token(&self) -> &str {
        self.app.secret.operator_token()
    }

    /// Serves at `address` until Ctrl-C or a request to terminate. `listening` is told where, once it does.
    ///
    /// # Errors
    /// An address that cannot be listened at.
    pub fn run(self, address: SocketAddr, listening: impl FnOnce(SocketAddr)) -> Result<()> {
        let runtime =
            tokio::runtime::Builder::new_multi_thread().enable_all().build().context("cannot start threads")?;
        let router = router(self.app);
        runtime.block_on(async {
            let mut terminated = signal(SignalKind::terminate()).context("cannot wait for a signal")?;
            let listener = TcpListener::bind(address).await;
            let listener = listener.with_context(|| format!("cannot listen at {address}; choose another --port"))?;
            listening(listener.local_addr()?);
            let stop = async {
                tokio::select! {
                    _ = tokio::signal::ctrl_c() => {}
                    _ = terminated.recv() => {}
                }
            };
            listen::serve(listener, router, stop).await;
            anyhow::Ok(())
        })?;
        drop(runtime);
        // The last handle of the store is gone: its thread ends after what it was given.
        let _ = self.writer.join();
        Ok(())
    }
}
