export { Painter, type PainterOptions } from './painter';
export {
  checkInside, checkStrokes, parseStrokes, serializeStrokes, StrokeFileError,
  type Fill, type Point, type StrokeEntry, type StrokeFile,
} from './model/stroke_file';
export { english, type Texts } from './texts';
export type { PreviewSource } from './view/preview';
