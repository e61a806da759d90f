// Calls of the studio (client/studio/README.md). Errors are StudioError with a text for the user.

export class StudioError extends Error {
  constructor(message: string, readonly code: string) {
    super(message);
  }
}

export interface PhotoSet { id: string; name: string; scene: string; created_s: number; is_own: boolean; as_frames: boolean }
export interface FoundPhoto { name: string; width?: number; height?: number; problem?: string }
export interface Found {
  kind: string; name: string; bytes: number; has_poses: boolean; in_color: boolean | null;
  notes: string[]; photos: FoundPhoto[];
}
export interface Job {
  id: string; scene: string; kind: string; state: string; created_s: number; ended_s: number;
  key_view: string; queue_position: number; waits_for: string; error?: string; warnings: string[];
}
export interface Stage {
  id: string; kind: string; state: string; cached: boolean; share: number; message: string;
  seconds: number; seconds_left: number; left_out?: string; error?: string;
}
export interface Artifact { name: string; media_type: string; bytes: number }
export interface Run extends Job {
  stages: Stage[]; seconds_left: number | null; expected_error: number | null;
  pictures: { job: string; kind: string; name: string }[]; artifacts: Artifact[];
}
export interface Plan {
  seconds: number; bytes: number; measured_jobs: number;
  stages: { kind: string; runs: boolean; reason: string; seconds: number; bytes: number }[];
  budgets: { seconds: number; too_short: boolean; error?: number; low?: number; high?: number }[];
}
export interface KeyViews {
  view: string; description: string;
  views: { name: string; expected_error: number | null; saves: number | null }[];
}
export interface State {
  server: { version: string; address: string; presets: string[]; knows_words: boolean }; sets: PhotoSet[]; jobs: Job[];
}
// Where the colours of a photo come from, and strokes above them. picture: a kept one; made_by: the job that coloured the
// photo by a reference or words; strokes: the text of a file of strokes.
export type Source = 'automatic' | 'picture' | 'reference' | 'words' | 'nothing';
export interface Colors { color: Source; picture?: string; words?: string; made_by?: string; strokes?: string }
export interface KeyChoice extends Colors { key_view: string }
export interface Choices extends KeyChoice {
  preset: string;
  poses?: boolean; // films: also a scene in 3D
  further?: KeyChoice[]; // more coloured photos
}

const answerOf = async (request: Promise<Response>): Promise<Response> => {
  let response: Response;
  try {
    response = await request;
  } catch (error) {
    if (error instanceof DOMException && error.name === 'AbortError') throw error;
    throw new StudioError('The studio does not answer. Start Color3D Studio again from the menu, or with `color3d studio`.', 'UNREACHABLE');
  }
  if (response.ok) return response;
  const body = await response.json().catch(() => null) as { error?: { code: string; message: string } } | null;
  throw new StudioError(body?.error?.message ?? `The studio answered ${response.status}.`, body?.error?.code ?? 'UNKNOWN');
};

export const get = async <T>(path: string): Promise<T> => (await answerOf(fetch(path))).json() as Promise<T>;
export const post = async <T>(path: string, body: unknown = {}): Promise<T> =>
  (await answerOf(fetch(path, { method: 'POST', body: JSON.stringify(body) }))).json() as Promise<T>;
export const query = (values: Record<string, string | number>): string =>
  new URLSearchParams(Object.entries(values).map(([name, value]) => [name, String(value)])).toString();

export const getState = (): Promise<State> => get('/api/state');
export const makeSet = (name: string): Promise<PhotoSet> => post('/api/sets', { name });
export const describeSet = async (id: string): Promise<PhotoSet & { found: Found }> => {
  const set = await get<PhotoSet & { found?: Found; problem?: string }>(`/api/sets/${id}`);
  if (!set.found) throw new StudioError(set.problem ?? 'These files cannot be used.', 'INVALID_ARGUMENT');
  return { ...set, found: set.found };
};
export const sendFile = async (id: string, name: string, file: Blob): Promise<void> => {
  await answerOf(fetch(`/api/sets/${id}/files?${query({ name })}`, { method: 'POST', body: file }));
};
export const keepPicture = async (id: string, file: File): Promise<{ picture: string; width: number; height: number }> =>
  (await answerOf(fetch(`/api/sets/${id}/pictures?${query({ name: file.name })}`, { method: 'POST', body: file }))).json();
export const photoUrl = (id: string, name: string, side = 0, gray = false): string =>
  `/api/sets/${id}/photo?${query({ name, ...(side ? { side } : {}), ...(gray ? { gray: 1 } : {}) })}`;
export const planRun = (id: string, preset: string): Promise<Plan> => post(`/api/sets/${id}/plan`, { preset });
export const selectKey = (id: string, count: number): Promise<Job> => post(`/api/sets/${id}/key`, { count });
export const keyViews = (job: string): Promise<KeyViews> => get(`/api/jobs/${job}/key-views`);
export const colorize = (id: string, choices: Choices): Promise<Job> => post(`/api/sets/${id}/colorize`, choices);
// A PNG of the coloured photo; maxSide 0: at full size, as a run colours it.
export const previewColors = async (
  id: string, photo: string, colors: Colors, maxSide: number, signal?: AbortSignal,
): Promise<Blob> => {
  const body = JSON.stringify({ photo, ...colors, max_side: maxSide });
  return (await answerOf(fetch(`/api/sets/${id}/preview`, { method: 'POST', body, signal }))).blob();
};
export const getJob = (id: string): Promise<Job> => get(`/api/jobs/${id}`);
export const getRun = async (id: string): Promise<Run> => new Promise((done, failed) => {
  const stop = follow(id, { run: (run) => { stop(); done(run); }, problem: (text) => failed(new StudioError(text, 'UNKNOWN')), end: () => undefined });
});
// Colours one photo by a reference or words: a job.
export const colorBelow = (id: string, photo: string, colors: Colors): Promise<Job> =>
  post(`/api/sets/${id}/below`, { photo, ...colors });
export const cancelJob = (id: string): Promise<Job> => post(`/api/jobs/${id}/cancel`);
export const retryJob = (id: string): Promise<Job> => post(`/api/jobs/${id}/retry`);
export const artifactUrl = (job: string, name: string, download = false): string =>
  `/api/jobs/${job}/artifact?${query({ name, ...(download ? { download: 1 } : {}) })}`;
export const previewOfRun = async (job: string, set: string, name: string, side: number): Promise<Blob> =>
  (await answerOf(fetch(`/api/jobs/${job}/preview?${query({ set, name, side })}`))).blob();

// Follows a job until it has ended. Returns a function that stops.
export const follow = (
  id: string, on: { run: (run: Run) => void; problem: (text: string) => void; end: () => void },
): (() => void) => {
  const source = new EventSource(`/api/jobs/${id}/events`);
  source.onmessage = ({ data }) => on.run(JSON.parse(data as string) as Run);
  source.addEventListener('problem', (event) => {
    on.problem(JSON.parse((event as MessageEvent<string>).data) as string);
    source.close();
  });
  source.addEventListener('end', () => {
    source.close();
    on.end();
  });
  source.onerror = () => {
    if (source.readyState === EventSource.CLOSED) on.problem('The studio does not answer. Start Color3D Studio again from the menu, or with `color3d studio`.');
  };
  return () => source.close();
};
