// Waits for a job that makes something to save, with a bar.
import { follow, type Run } from '../api';
import { bar, problem, replace, say } from '../dom';
import { seconds } from '../words';

// Shows the progress in `place` and calls `done` with the finished job. Returns a function that stops.
export const waitFor = (job: string, what: string, place: Element, done: (run: Run) => void): (() => void) => {
  const progress = bar(what);
  const text = document.createElement('span');
  text.className = 'soft small';
  text.textContent = `${what} …`;
  progress.set(null);
  replace(place, text, progress.element);
  say(text.textContent);
  let last: Run | undefined;
  return follow(job, {
    run: (run) => {
      last = run;
      const now = run.stages.find((stage) => stage.state === 'RUNNING');
      const share = now?.share ?? 0;
      progress.set(share > 0 ? share : null);
      text.textContent = run.queue_position > 0 ? `${what}: place ${run.queue_position} in the queue`
        : now && now.seconds_left > 1 ? `${what}: about ${seconds(now.seconds_left)} left` : `${what} …`;
    },
    problem: (message) => replace(place, problem(message)),
    end: () => {
      if (last?.state === 'SUCCEEDED') done(last);
      else replace(place, problem(last?.error ?? last?.stages.find((stage) => stage.error)?.error ?? 'This did not work.'));
    },
  });
};
