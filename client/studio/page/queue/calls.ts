// Calls of the studio for the queue.
import { get, post, type Job } from '../api';

export interface Waiting extends Job { has_begun: boolean }

export const getQueue = async (): Promise<Waiting[]> => (await get<{ runs: Waiting[] }>('/api/queue')).runs;
// Brings the runs that wait into this order. Returns the new IDs of those that were submitted again.
export const reorder = async (order: string[]): Promise<Record<string, string>> =>
  (await post<{ moved: Record<string, string> }>('/api/queue', { order })).moved;
export const movedTo = async (id: string): Promise<string> => (await get<{ to: string }>(`/api/jobs/${id}/moved`)).to;
