// A page of a run while its service goes away and comes back, in headless Chromium; tells what was seen, as JSON.
//   node lose_service.mjs CHROMIUM ADDRESS MARK [SCREENSHOTS]
// ADDRESS: as `color3d studio FOLDER` printed it; MARK: a file that is written once the run goes on: then the service is
// to be ended, and started again some time later. done: whether the run ended well on the same page; second: status of
// photos that were dropped meanwhile.
import { writeFileSync } from 'node:fs';

import { openPage } from '../../tests/support/page_hand.mjs';

const [chromium, address, mark, screenshots] = process.argv.slice(2);
const { evaluate, waitFor, tell } = openPage(chromium, address, screenshots, { flags: ['--window-size=1280,900'] });

const use = async () => {
  await waitFor('!!document.querySelector("#go-on")');
  const set = await evaluate('location.hash.split("/")[1]');
  await evaluate(`(async () => {
    const body = JSON.stringify({ preset: 'fast', color: 'automatic' });
    const answer = await fetch('/api/sets/${set}/colorize', { method: 'POST', body });
    location.hash = 'job/' + (await answer.json()).id;
  })()`);
  await waitFor('!!document.querySelector(".stage.state-running")', 120000);
  writeFileSync(mark, '');
  // Photos are taken without the service.
  const second = await evaluate(`(async () => {
    const made = await (await fetch('/api/sets', { method: 'POST', body: '{"name": "second"}' })).json();
    const answer = await fetch('/api/sets/' + made.id + '/files?name=a.jpg', { method: 'POST', body: 'bytes' });
    return answer.status;
  })()`);
  await waitFor('document.querySelector("main").dataset.state === "done"', 300000, { despite: true });
  return { second, done: !(await evaluate('!!document.querySelector(".problem")')) };
};

await tell(use);
