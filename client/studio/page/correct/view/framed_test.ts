// The other side of scene_frame.ts: how the page of a scene finds places and colours (core/view/page/framed.js).
import assert from 'node:assert/strict';
import test from 'node:test';

import { viewPageScript } from '../check/view_page';

type Point = [number, number, number];
interface Photo { name: string; held_out: boolean; position: Point; rotation: [number, number, number, number]; aspect: number; tan: number; center: [number, number] }
interface Framed {
  firstSurface(centers: Float32Array, from: Point, direction: Point): number;
  inPhoto(photo: Photo, point: Point): { x: number; y: number; distance: number } | null;
  bestPhoto(photos: Photo[], centers: Float32Array, from: Point, point: Point): { photo: string; x: number; y: number } | null;
  changesOf(photos: Photo[], centers: Float32Array, maps: object[]): Uint8Array;
}
const framed = new Function(`${viewPageScript('framed.js')}; return color3dFramed;`)() as Framed;

const photoAt = (name: string, x: number, held_out = false): Photo =>
  ({ name, held_out, position: [x, 0, 0], rotation: [0, 0, 0, 1], aspect: 1.5, tan: 0.5, center: [0.5, 0.5] });
// Gaussians every 0.02 on a wall that faces the cameras, from (left, -3) to (right, 3).
const wall = (z: number, left: number, right: number): number[] => {
  const points: number[] = [];
  for (let x = left; x < right; x += 0.02) for (let y = -1; y < 1; y += 0.02) points.push(x, y, z);
  return points;
};
const back = Float32Array.from(wall(-5, -3, 3));
const withFront = Float32Array.from([...wall(-5, -3, 3), ...wall(-2, -0.4, 0.4), 0, 0, -0.5]);

test('a photo shows points in front of it at their place', () => {
  const photo = photoAt('a', 0);
  assert.equal(framed.inPhoto(photo, [0, 0, 5]), null);
  const at = framed.inPhoto(photo, [1.5, 1, -4])!;
  assert.ok(Math.abs(at.x - 0.75) < 1e-9 && Math.abs(at.y - 0.25) < 1e-9);
  // Turned by 90 degrees about y: it looks along -x.
  const turned = { ...photo, rotation: [0, Math.SQRT1_2, 0, Math.SQRT1_2] as [number, number, number, number] };
  assert.equal(framed.inPhoto(turned, [0, 0, -4]), null);
  assert.ok(Math.abs(framed.inPhoto(turned, [-4, 0, 0])!.x - 0.5) < 1e-6);
});

test('a ray ends at the first surface, and single Gaussians before it do not stop it', () => {
  assert.ok(Math.abs(framed.firstSurface(back, [0, 0, 0], [0, 0, -1]) - 5) < 0.1);
  assert.ok(Math.abs(framed.firstSurface(withFront, [0, 0, 0], [0, 0, -1]) - 2) < 0.1);
  assert.ok(Number.isNaN(framed.firstSurface(back, [0, 0, 0], [0, 0, 1])));
});

test('a place is given in the photo that sees it most alike, not hidden and not held out', () => {
  const photos = [photoAt('middle', 0), photoAt('right', 1), photoAt('kept', 0.05, true)];
  assert.equal(framed.bestPhoto(photos, back, [0.1, 0, 0], [0, 0, -5])!.photo, 'middle');
  // The front wall hides the middle of the back one from the camera in the middle.
  assert.equal(framed.bestPhoto(photos, withFront, [0.1, 0, 0], [0, 0, -5])!.photo, 'right');
  assert.equal(framed.bestPhoto(photos, back, [0, 0, 0], [0, 0, 5]), null);
});

test('Gaussians take the change of the photos that show them', () => {
  const photos = [photoAt('a', 0)];
  const ab = new Int8Array(2 * 30 * 20);
  for (let i = 0; i < ab.length; i += 2) ab[i] = (i / 2) % 30 < 15 ? 40 : 0; // the left half gets redder
  const changes = framed.changesOf(photos, withFront, [{ photo: 'a', width: 30, height: 20, ab }]);
  const at = (x: number, z: number): number => {
    for (let i = 0; i < withFront.length; i += 3) {
      if (Math.abs(withFront[i]! - x) < 0.011 && Math.abs(withFront[i + 1]!) < 0.011 && withFront[i + 2] === z) return changes[(2 * i) / 3]!;
    }
    throw new Error('no such Gaussian');
  };
  assert.equal(at(-1.5, -5), 168);
  assert.equal(at(1.5, -5), 128);
  assert.equal(at(-0.3, -2), 168);
  assert.equal(at(-0.3, -5), 128, 'hidden behind the front wall');
});
