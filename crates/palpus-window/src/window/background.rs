//! Background work of a window on its own thread: the newest request is answered, and older
//! requests are dropped.
//!
//! In each frame, the window may send a request and poll for an answer; it never waits. A new
//! request makes the current one *superseded*. Long work checks regularly whether it is superseded.

use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;

/// A thread that gives answers `A` to questions `Q`.
pub(super) struct Background<Q, A> {
    state: Arc<JobState<Q, A>>,
    thread: Option<JoinHandle<()>>,
}

/// State shared by window and thread.
pub(super) struct JobState<Q, A> {
    slots: Mutex<Slots<Q, A>>,
    asked: Condvar,
    /// Tells the window that a new answer is ready.
    wake: Box<dyn Fn() + Send + Sync>,
}

struct Slots<Q, A> {
    question: Option<Q>,
    answer: Option<A>,
    busy: bool,
    over: bool,
}

impl<Q: Send + 'static, A: Send + 'static> Background<Q, A> {
    /// Starts the thread. `work` is called with each request, and may give several answers, each
    /// better than the previous answer. `wake` is called after each answer.
    pub(super) fn new(
        wake: impl Fn() + Send + Sync + 'static,
        mut work: impl FnMut(Q, &JobState<Q, A>) + Send + 'static,
    ) -> Self {
        let slots = Slots { question: None, answer: None, busy: false, over: false };
        let state = Arc::new(JobState { slots: Mutex::new(slots), asked: Condvar::new(), wake: Box::new(wake) });
        let shared = Arc::clone(&state);
        let thread = std::thread::Builder::new().name("window background".to_owned());
        // If no thread can be started, there are no answers.
        let thread = thread.spawn(move || {
            while let Some(question) = shared.next() {
                work(question, &shared);
            }
        });
        Self { state, thread: thread.ok() }
    }

    /// Sends a request, which replaces an earlier request.
    pub(super) fn ask(&self, question: Q) {
        if let Ok(mut slots) = self.state.slots.lock() {
            slots.question = Some(question);
            slots.busy = true;
            self.state.asked.notify_one();
        }
    }

    /// Returns the newest answer, once.
    pub(super) fn answer(&self) -> Option<A> {
        self.state.slots.lock().ok()?.answer.take()
    }

    /// True while further answers are expected.
    pub(super) fn is_busy(&self) -> bool {
        self.state.slots.lock().is_ok_and(|slots| slots.busy)
    }
}

impl<Q, A> JobState<Q, A> {
    /// Waits for the next request; `None` when the window is closed.
    fn next(&self) -> Option<Q> {
        let mut slots = self.slots.lock().ok()?;
        loop {
            if slots.over {
                return None;
            }
            if let Some(question) = slots.question.take() {
                return Some(question);
            }
            if slots.busy {
                slots.busy = false;
                drop(slots);
                (self.wake)();
                slots = self.slots.lock().ok()?;
                continue;
            }
            slots = self.asked.wait(slots).ok()?;
        }
    }

    /// Stores an answer for the window.
    pub(super) fn answer(&self, answer: A) {
        if let Ok(mut slots) = self.slots.lock() {
            slots.answer = Some(answer);
        }
        (self.wake)();
    }

    /// True if there is a newer request.
    pub(super) fn is_superseded(&self) -> bool {
        self.slots.lock().map_or(true, |slots| slots.over || slots.question.is_some())
    }
}

impl<Q, A> Drop for Background<Q, A> {
    fn drop(&mut self) {
        if let Ok(mut slots) = self.state.slots.lock() {
            slots.over = true;
        }
        self.state.asked.notify_one();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn newest_request_is_answered_and_older_work_stops() {
        let (woken, waking) = channel();
        let background = Background::new(
            move || {
                let _ = woken.send(());
            },
            |question: u32, state: &JobState<u32, u32>| {
                // The job works on the first request until there is another request.
                while question == 1 && !state.is_superseded() {
                    std::thread::yield_now();
                }
                state.answer(question * 10);
            },
        );
        background.ask(1);
        background.ask(2);
        let mut last = None;
        while last != Some(20) {
            waking.recv().expect("the job wakes the window");
            last = background.answer().or(last);
        }
        while background.is_busy() {
            waking.recv().expect("the job reports that it has finished");
        }
        assert_eq!(background.answer(), None);
    }
}
