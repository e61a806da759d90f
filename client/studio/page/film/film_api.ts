// Calls about films (client/studio/README.md).
import { getJson, postJson, previewStrokes, query, type Job } from '../api';

export interface FilmFacts {
  frames: number; seconds: number; frames_per_second: number; width: number; height: number; codec: string;
  has_sound: boolean; in_color: boolean | null; is_video: boolean; notes: string[];
}
export interface JobFrame { view: string; automatic: boolean; begin_s: number | null; end_s: number | null }
export interface JobTimeline {
  names: string[]; times: number[]; shots: number[]; coverage: (number | null)[];
  keys: JobFrame[]; parts: JobFrame[];
  next: { view: string; error_now: number; error_with: number } | null; poses: boolean;
}
export interface FrameColor {
  kept?: number; view?: string; color?: string; strokes?: readonly unknown[]; picture?: string;
  begin_s?: number; end_s?: number;
}
export interface FilmChoices {
  preset?: string; poses?: boolean; steady_exposure?: boolean; frames_per_second?: number;
  keys: FrameColor[]; parts: FrameColor[];
}

export const describeFilm = (set: string): Promise<FilmFacts> => getJson(`/api/sets/${set}/film`);
export const setAsFrames = (set: string, areFrames: boolean): Promise<unknown> =>
  postJson(`/api/sets/${set}/film/frames`, { are_frames: areFrames });
export const colorizeFilm = (set: string, choices: FilmChoices): Promise<Job> =>
  postJson(`/api/sets/${set}/film/colorize`, choices);
export const changeFilm = (set: string, job: string, choices: FilmChoices): Promise<Job> =>
  postJson(`/api/jobs/${job}/film/change`, { set, ...choices });
export const timelineOf = (job: string): Promise<JobTimeline> => getJson(`/api/jobs/${job}/film`);

export const frameUrl = (set: string, name: string, side: number, gray: boolean): string =>
  `/api/sets/${set}/film/frame?${query({ name, ...(side ? { side } : {}), ...(gray ? { gray: 1 } : {}) })}`;
export const filmUrl = (set: string): string => `/api/sets/${set}/film/video`;
export const movieUrl = (job: string, name: string): string => `/api/jobs/${job}/film/video?${query({ name })}`;
export const movieFrameUrl = (job: string, name: string, frame: number, side: number): string =>
  `/api/jobs/${job}/film/frame?${query({ name, frame, side })}`;
// A frame in first colours, from the coloured frame of a run that goes on.
export const earlyUrl = (job: string, set: string, name: string, side: number): string =>
  `/api/jobs/${job}/preview?${query({ set, name, side })}`;
// The frame in the colours of strokes, while somebody paints.
export const previewFrame = (
  set: string, name: string, strokes: readonly unknown[], side: number, signal: AbortSignal,
): Promise<ImageBitmap> => previewStrokes(set, name, strokes, side, signal);
