// A headless Chromium driven by the Chrome DevTools Protocol over a pipe. Needs no npm package.
//   const browser = openBrowser(CHROMIUM, FLAGS, isError);
//   await browser.open(); await browser.send('Page.navigate', ...); await browser.evaluate('...');
//   await browser.close();
// errors: texts of exceptions and of console messages for which isError(type); requests: URLs of external
// requests.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

export const pause = (ms) => new Promise((done) => setTimeout(done, ms));

export const openBrowser = (chromium, flags, isError = () => true) => {
  const profile = mkdtempSync(join(tmpdir(), 'color3d-browser-'));
  const process_ = spawn(chromium, [
    '--headless', '--no-sandbox', '--no-first-run', '--remote-debugging-pipe',
    '--disable-dev-shm-usage', ...flags, '--user-data-dir=' + profile,
  ], { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
  process_.on('error', (error) => { console.error(String(error)); process.exit(1); });

  const waiting = new Map();
  const errors = [], requests = [];
  let buffer = '', next = 1, session;
  const receive = ({ id, error, result, method, params }) => {
    if (id) {
      const { done, failed } = waiting.get(id);
      waiting.delete(id);
      return error ? failed(new Error(error.message)) : done(result);
    }
    if (method === 'Runtime.exceptionThrown') errors.push(params.exceptionDetails.text);
    if (method === 'Runtime.consoleAPICalled' && isError(params.type)) {
      errors.push(params.args.map((arg) => arg.value ?? arg.description).join(' '));
    }
    if (method === 'Log.entryAdded' && params.entry.level === 'error') errors.push(`${params.entry.text} ${params.entry.url ?? ''}`.trim());
    if (method === 'Network.requestWillBeSent' && !/^(data|blob|file):/.test(params.request.url)) {
      requests.push(params.request.url);
    }
  };
  process_.stdio[4].on('data', (data) => {
    const messages = (buffer + data).split('\0');
    buffer = messages.pop();
    for (const text of messages) receive(JSON.parse(text));
  });
  // `to`: the session of another target; null: the browser.
  const send = (method, params = {}, to = session) => new Promise((done, failed) => {
    waiting.set(next, { done, failed });
    process_.stdio[3].write(JSON.stringify({ id: next++, method, params, sessionId: to ?? undefined }) + '\0');
  });
  // Opens an empty page, the target of all commands that follow.
  const open = async () => {
    session = undefined;
    const { targetId } = await send('Target.createTarget', { url: 'about:blank' });
    session = (await send('Target.attachToTarget', { targetId, flatten: true })).sessionId;
    for (const domain of ['Page', 'Runtime', 'Log', 'Network']) await send(domain + '.enable');
  };
  const evaluate = async (expression) => {
    const answer = await send('Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true });
    if (answer.exceptionDetails) throw new Error(answer.exceptionDetails.exception.description);
    return answer.result.value;
  };
  const close = async () => {
    session = undefined;
    const ended = new Promise((done) => process_.once('exit', done));
    send('Browser.close').catch(() => {});
    await Promise.race([ended, pause(5000)]);
    process_.kill('SIGKILL');
    rmSync(profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
  };
  return { send, open, evaluate, close, errors, requests };
};
