//! Prepares the next scene in a background job while the current run goes on.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use anyhow::anyhow;
use palpus_window::Loading;

/// A background job with its progress and its result.
pub(super) struct Loader<T> {
    progress: Arc<Mutex<Loading>>,
    thread: Option<JoinHandle<anyhow::Result<T>>>,
}

/// Reports progress: the current step, and its finished share (0 to 1) if that is known.
pub(super) type Tell<'a> = &'a (dyn Fn(&str, Option<f64>) + Sync);

impl<T: Send + 'static> Loader<T> {
    /// Creates a loader without work.
    pub(super) fn new() -> Self {
        Self { progress: Arc::default(), thread: None }
    }

    /// Starts `work`, with `words` as the name of its first step.
    ///
    /// # Errors
    ///
    /// Fails if other work is in progress.
    pub(super) fn begin(
        &mut self,
        words: &str,
        work: impl FnOnce(Tell<'_>) -> anyhow::Result<T> + Send + 'static,
    ) -> Result<(), String> {
        if self.thread.is_some() {
            return Err("something else is being prepared; wait for it".to_owned());
        }
        set(&self.progress, Loading::UnderWay { words: words.to_owned(), part: None });
        let progress = Arc::clone(&self.progress);
        let tell = move |words: &str, part: Option<f64>| {
            set(&progress, Loading::UnderWay { words: words.to_owned(), part });
        };
        let thread = std::thread::Builder::new().name("prepare".to_owned()).spawn(move || work(&tell));
        self.thread = Some(thread.map_err(|error| format!("the preparing thread could not start: {error}"))?);
        Ok(())
    }

    /// Returns the progress.
    pub(super) fn progress(&self) -> Loading {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Returns the result once, when it is ready. The job stays in progress until [`Self::end`] is
    /// called.
    pub(super) fn take(&mut self) -> Option<anyhow::Result<T>> {
        let thread = self.thread.take_if(|thread| thread.is_finished())?;
        let failed = |_| anyhow!("it could not be prepared; please report this");
        Some(thread.join().map_err(failed).and_then(|result| result))
    }

    /// Ends the job with success or with its error.
    pub(super) fn end(&self, result: anyhow::Result<()>) {
        set(&self.progress, result.map_or_else(|error| Loading::Failed(one_line(&error)), |()| Loading::Idle));
    }
}

fn set(progress: &Mutex<Loading>, loading: Loading) {
    *progress.lock().unwrap_or_else(PoisonError::into_inner) = loading;
}

/// Formats an error and its causes as one line.
pub(super) fn one_line(error: &anyhow::Error) -> String {
    format!("{error:#}").lines().map(str::trim).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::time::Duration;

    use super::*;

    fn done<T: Send + 'static>(loader: &mut Loader<T>) -> anyhow::Result<T> {
        loop {
            if let Some(result) = loader.take() {
                return result;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn work_reports_progress_and_finishes_once() {
        let mut loader = Loader::new();
        assert_eq!(loader.progress(), Loading::Idle);
        let (go, wait) = mpsc::channel::<()>();
        let (said, heard) = mpsc::channel::<()>();
        loader
            .begin("reading", move |tell| {
                tell("half way", Some(0.5));
                said.send(())?;
                wait.recv()?;
                Ok(7)
            })
            .expect("the work starts");
        heard.recv().expect("the work has started");
        assert_eq!(loader.progress(), Loading::UnderWay { words: "half way".to_owned(), part: Some(0.5) });
        assert!(loader.take().is_none() && loader.begin("more", |_| Ok(8)).is_err());
        go.send(()).expect("the work waits");
        assert_eq!(done(&mut loader).expect("the work succeeds"), 7);
        loader.end(Ok(()));
        assert!(loader.progress() == Loading::Idle && loader.take().is_none());
    }

    #[test]
    fn failure_is_one_line_until_the_next_work() {
        let mut loader = Loader::<()>::new();
        let fail = |_: Tell<'_>| Err(anyhow!("line 3:\n  no number").context("cup.obj cannot be read"));
        loader.begin("reading", fail).expect("the work starts");
        let result = done(&mut loader);
        loader.end(result);
        assert_eq!(loader.progress(), Loading::Failed("cup.obj cannot be read: line 3: no number".to_owned()));
        loader.begin("reading", |_| Ok(())).expect("the work starts");
        assert!(matches!(loader.progress(), Loading::UnderWay { .. }));
    }
}
