//! The smallest executor: tasks that are polled when they are woken, one poll at a time, so that power
//! can fail between two of them, and all dropped at once when it does.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::pin::Pin;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Wake, Waker};

type Work = Pin<Box<dyn Future<Output = ()>>>;
type Ready = Arc<Mutex<VecDeque<usize>>>;

/// The tasks of a machine that has power.
#[derive(Default)]
pub struct Tasks {
    tasks: Vec<Task>,
    ready: Ready,
    spawner: Spawner,
}

struct Task {
    /// None when it has ended.
    work: Option<Work>,
    wakes: Arc<Wakes>,
    waker: Waker,
}

struct Wakes {
    index: usize,
    queued: AtomicBool,
    ready: Ready,
}

impl Wake for Wakes {
    fn wake(self: Arc<Self>) {
        if !self.queued.swap(true, Ordering::Relaxed) {
            let mut ready = self.ready.lock().unwrap_or_else(PoisonError::into_inner);
            ready.push_back(self.index);
        }
    }
}

/// Takes tasks for [`Tasks`].
#[derive(Clone, Default)]
pub struct Spawner(Rc<RefCell<Vec<Work>>>);

impl Spawner {
    /// One more task.
    pub fn spawn(&self, work: impl Future<Output = ()> + 'static) {
        self.0.borrow_mut().push(Box::pin(work));
    }
}

impl Tasks {
    /// The way to more tasks.
    pub fn spawner(&self) -> Spawner {
        self.spawner.clone()
    }

    /// Whether there is none, nor one to come.
    pub fn is_empty(&self) -> bool {
        self.tasks.is_empty() && self.spawner.0.borrow().is_empty()
    }

    /// Polls a task that is ready; `false` when none is.
    pub fn poll_one(&mut self) -> bool {
        for work in self.spawner.0.take() {
            let wakes = Arc::new(Wakes {
                index: self.tasks.len(),
                queued: AtomicBool::new(false),
                ready: self.ready.clone(),
            });
            let waker = Waker::from(wakes.clone());
            waker.wake_by_ref();
            self.tasks.push(Task {
                work: Some(work),
                wakes,
                waker,
            });
        }
        let next = self
            .ready
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop_front();
        let Some(index) = next else {
            return false;
        };
        let task = &mut self.tasks[index];
        task.wakes.queued.store(false, Ordering::Relaxed);
        if let Some(work) = &mut task.work
            && let Poll::Ready(()) = work.as_mut().poll(&mut Context::from_waker(&task.waker))
        {
            task.work = None;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_futures::yield_now;

    #[test]
    fn tasks_take_turns_in_the_order_in_which_they_are_woken() {
        let mut tasks = Tasks::default();
        let said = Rc::new(RefCell::new(String::new()));
        for name in ['a', 'b'] {
            let (said, spawner) = (said.clone(), tasks.spawner());
            tasks.spawner().spawn(async move {
                for _ in 0..2 {
                    said.borrow_mut().push(name);
                    yield_now().await;
                }
                let later = said.clone();
                spawner.spawn(async move { later.borrow_mut().push('+') });
            });
        }
        while tasks.poll_one() {}
        assert_eq!(*said.borrow(), "abab++");
    }

    #[test]
    fn they_are_dropped_where_they_stand() {
        let mut tasks = Tasks::default();
        let held = Rc::new(());
        let inside = held.clone();
        tasks.spawner().spawn(async move {
            std::future::pending::<()>().await;
            drop(inside);
        });
        assert!(tasks.poll_one());
        assert!(!tasks.poll_one());
        drop(tasks);
        assert_eq!(Rc::strong_count(&held), 1);
    }
}
