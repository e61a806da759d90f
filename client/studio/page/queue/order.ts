// Orders of the queue. Pure functions.

// The list with item `from` at place `to`.
export const withMoved = <T>(items: readonly T[], from: number, to: number): T[] => {
  const rest = items.filter((_, i) => i !== from);
  const item = items[from];
  if (item !== undefined) rest.splice(Math.max(0, Math.min(to, rest.length)), 0, item);
  return rest;
};
