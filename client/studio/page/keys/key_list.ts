// The photos that the user coloured for one run, the most important first. Pure functions.

// The list with `key` in the place of the same photo, else at its end.
export const withKey = <T extends { key_view: string }>(keys: readonly T[], key: T): T[] => {
  const at = keys.findIndex(({ key_view }) => key_view === key.key_view);
  return at < 0 ? [...keys, key] : keys.map((one, i) => (i === at ? key : one));
};

export const withoutKey = <T extends { key_view: string }>(keys: readonly T[], view: string): T[] =>
  keys.filter(({ key_view }) => key_view !== view);

// The first of `views` that is in no key; undefined if all are.
export const nextView = (keys: readonly { key_view: string }[], views: readonly string[]): string | undefined =>
  views.find((view) => !keys.some(({ key_view }) => key_view === view));

// What a run is told: the first key and the others.
export const asChoices = <T>(keys: readonly T[]): T & { further?: T[] } => {
  const [first, ...further] = keys;
  return { ...first!, ...(further.length ? { further } : {}) };
};
