// What things are called and how numbers read. Pure functions.

const stageWords: Record<string, string> = {
  import_scene: 'Find where the photos were taken',
  select_key_view: 'Choose the photo to colour',
  colorize_key_view: 'Colour the key photo',
  reconstruct_geometry: 'Build the scene in grey',
  carry_color: 'Carry its colours to the other photos',
  correct_colors: 'Apply corrections',
  generate_augmentations: 'Vary the key photo for practice',
  personalize: 'Learn the colours of this place',
  colorize_views: 'Colour every photo',
  solve_chroma: 'Colour the scene',
  export: 'Write the scene',
  render: 'Draw the views',
  evaluate: 'Measure the colours',
  colorize_scene: 'Write the report',
};

const stateWords: Record<string, string> = {
  BLOCKED: 'waiting', QUEUED: 'in the queue', RUNNING: 'working', SUCCEEDED: 'done', FAILED: 'failed',
  CANCELLED: 'cancelled', SKIPPED: 'left out',
};

const kindWords: Record<string, string> = {
  photos: 'photos', film: 'a film', films: 'films of several cameras', splat: 'a 3D scene of another program',
};

export const stageName = (kind: string): string => stageWords[kind] ?? kind.replaceAll('_', ' ');
export const stateName = (state: string): string => stateWords[state] ?? state.toLowerCase();
export const kindName = (kind: string): string => kindWords[kind] ?? kind;
export const isFinished = (state: string): boolean =>
  ['SUCCEEDED', 'FAILED', 'CANCELLED', 'SKIPPED'].includes(state);

export const seconds = (value: number): string => {
  if (value < 1) return 'under a second';
  if (value < 90) return `${Math.round(value)} s`;
  if (value < 5400) return `${Math.round(value / 60)} min`;
  const hours = Math.floor(value / 3600);
  return `${hours} h ${String(Math.round((value - 3600 * hours) / 60)).padStart(2, '0')} min`;
};

export const bytes = (value: number): string => {
  if (value < 1000) return `${value} B`;
  const units = ['kB', 'MB', 'GB', 'TB'];
  let unit = -1;
  while (value >= 999.5 && unit < units.length - 1) {
    value /= 1000;
    ++unit;
  }
  return `${value < 10 ? value.toFixed(1) : Math.round(value)} ${units[unit]}`;
};

export const day = (unixSeconds: number): string =>
  new Date(1000 * unixSeconds).toLocaleString(undefined, { dateStyle: 'medium', timeStyle: 'short' });

// The error of colours in words, for people who do not know CIEDE2000.
export const errorInWords = (error: number): string => {
  const value = error.toFixed(1);
  if (error < 2) return `${value}: hardly visible`;
  if (error < 4) return `${value}: visible side by side`;
  if (error < 7) return `${value}: clearly visible`;
  return `${value}: other colours`;
};
