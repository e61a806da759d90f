// A canvas of at least one pixel. Throws where the browser gives none.
export const canvasOf = (width: number, height: number): [HTMLCanvasElement, CanvasRenderingContext2D] => {
  const canvas = document.createElement('canvas');
  canvas.width = Math.max(1, Math.round(width));
  canvas.height = Math.max(1, Math.round(height));
  const context = canvas.getContext('2d');
  if (!context) throw new Error('the browser gives no 2D canvas; close other pages and load this one anew');
  return [canvas, context];
};
