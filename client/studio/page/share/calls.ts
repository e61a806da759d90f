// Calls of the studio for sharing, and addresses of what can be saved.
import { get, post, query, type Job } from '../api';

export interface Credit { colored_by: string; key_view_by: string; source: string; licence: string; text?: string }
export interface Movie { path: 'orbit' | 'photos' | 'still'; seconds?: number; bounce?: boolean }

export const getCredit = (): Promise<Credit> => get('/api/credit');
export const keepCredit = (credit: Credit): Promise<Credit> => post('/api/credit', credit);
export const makeMovie = (run: string, movie: Movie): Promise<Job> => post(`/api/jobs/${run}/movie`, movie);
export const makeFile = (run: string, format: string): Promise<Job> => post(`/api/jobs/${run}/file`, { format });

const caption = (wanted: boolean): Record<string, number> => (wanted ? { caption: 1 } : {});
export const pictureUrl = (job: string, name: string, withCaption: boolean): string =>
  `/api/jobs/${job}/picture?${query({ name, ...caption(withCaption) })}`;
export const coloredUrl = (job: string, set: string, name: string, side: number): string =>
  `/api/jobs/${job}/colored?${query({ set, name, side })}`;
export const zipUrl = (job: string, set: string, side: number, withCaption: boolean): string =>
  `/api/jobs/${job}/colored.zip?${query({ set, ...(side ? { side } : {}), ...caption(withCaption) })}`;
export const framePictureUrl = (job: string, name: string, frame: number, withCaption: boolean): string =>
  `/api/jobs/${job}/film/picture?${query({ name, frame, ...caption(withCaption) })}`;
export const sideBySideUrl = (job: string, name: string): string => `/api/jobs/${job}/side-by-side?${query({ name })}`;
