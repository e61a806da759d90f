// Calls of the studio for corrections, listed in client/studio/README.md.
import { StudioError, type Job } from '../api';
import type { Stroke } from './model/strokes';
import type { Tone } from './model/tone';

export interface SceneView { name: string; width: number; height: number; photo_width: number; held_out: boolean }
export interface Correction { id: string; view: string; strokes: Stroke[] | null }
export interface Version {
  key: string; views: SceneView[]; has_sources: boolean; tone: Tone; corrections: Correction[];
}
export interface NewStroke { view: string; strokes: Stroke[]; reach: number }
export interface Change { add?: NewStroke; remove?: string[]; tone?: Partial<Tone> }
export interface VersionState { newest: string | null; working: string | null }
export type MapName = 'color' | 'base' | 'source' | 'pull';

const answer = async (request: Promise<Response>): Promise<Response> => {
  const response = await request.catch((error: unknown) => {
    if (error instanceof DOMException && error.name === 'AbortError') throw error;
    throw new StudioError('The studio does not answer. Start it again with `color3d studio`.', 'UNREACHABLE');
  });
  if (response.ok) return response;
  const body = await response.json().catch(() => null) as { error?: { code: string; message: string } } | null;
  throw new StudioError(body?.error?.message ?? `The studio answered ${response.status}.`, body?.error?.code ?? 'UNKNOWN');
};
const path = (run: string, rest = '', values: Record<string, string | number> = {}): string => {
  const query = new URLSearchParams(Object.entries(values).map(([name, value]) => [name, String(value)])).toString();
  return `/api/jobs/${run}/correct${rest}${query && `?${query}`}`;
};
const post = async (url: string, body: unknown): Promise<Job> =>
  (await answer(fetch(url, { method: 'POST', body: JSON.stringify(body) }))).json() as Promise<Job>;

// Values as they are in the file: without colour management and premultiplication.
const bitmap = async (url: string, signal: AbortSignal): Promise<ImageBitmap> => {
  const response = await answer(fetch(url, { signal }));
  return createImageBitmap(await response.blob(), { colorSpaceConversion: 'none', premultiplyAlpha: 'none' });
};

export const describe = async (run: string): Promise<Version> =>
  (await answer(fetch(path(run)))).json() as Promise<Version>;
export const getPhoto = (run: string, view: string, side: number, signal: AbortSignal): Promise<ImageBitmap> =>
  bitmap(path(run, '/photo', { view, side }), signal);
// null: there is no such map.
export const getMap = async (
  run: string, map: MapName, view: string, side: number, trial: string, signal: AbortSignal,
): Promise<ImageBitmap | null> => {
  try {
    return await bitmap(path(run, '/map', { map, view, side, ...(trial && { trial }) }), signal);
  } catch (error) {
    if (error instanceof StudioError && error.code === 'NOT_FOUND') return null;
    throw error;
  }
};
export const tryChange = (run: string, change: Change): Promise<Job> => post(path(run, '/try'), change);
export const applyChange = (run: string, change: Change): Promise<Job> => post(path(run), change);

// Follows the versions of the run, across interruptions. Returns how to stop.
export const followVersions = (run: string, show: (state: VersionState) => void, onProblem: (text: string) => void): (() => void) => {
  const source = new EventSource(path(run, '/events'));
  source.onmessage = ({ data }) => show(JSON.parse(data as string) as VersionState);
  source.addEventListener('problem', (event) => {
    source.close();
    onProblem(JSON.parse((event as MessageEvent<string>).data) as string);
  });
  return () => source.close();
};
