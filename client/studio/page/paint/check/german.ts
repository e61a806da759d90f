// Longer words, as another language has them.
import type { Texts } from '../texts';

export const german: Partial<Texts> = {
  language: 'de',
  actions: 'Aktionen', tools: 'Werkzeuge', brush: 'Pinsel', line: 'Gerade Linie', region: 'Flächen\u00adfüllung',
  eraser: 'Radier\u00adgummi', picker: 'Farbe auf\u00adnehmen', undo: 'Rückgängig machen', redo: 'Wiederherstellen',
  clear: 'Alle Striche entfernen', open: 'Striche öffnen', save: 'Striche speichern',
  zoomIn: 'Vergrößern', zoomOut: 'Verkleinern', fit: 'An Fenstergröße anpassen', compare: 'Nur das Foto zeigen',
  shortcuts: 'Tastenkombinationen', settings: 'Farben und Ebenen', size: 'Pinseldurchmesser',
  pressure: 'Stiftdruck bestimmt die Strichbreite', reach: 'Ausbreitungsreichweite',
  color: 'Farbeinstellungen', colorHere: 'So erscheint die Farbe an dieser Stelle', hue: 'Farbton',
  chroma: 'Farbsättigung', hex: 'Farbcode (hexadezimal)', neutral: 'Grau beibehalten',
  automatic: 'Automatische Farben beibehalten', recent: 'Zuletzt verwendete Farben', palette: 'Farbpalette',
  palettes: 'Natürliche Farbtöne', paletteFromPicture: 'Aus einem Referenzbild übernehmen',
  paletteFromList: 'Aus einer Farbliste übernehmen', layers: 'Bildebenen', layerStrokes: 'Farbstriche',
  layerPreview: 'Vorschau des Ergebnisses', layerAutomatic: 'Automatische Einfärbung',
  solid: 'Striche als deckende Farbfläche darstellen', photoColors: 'Ursprüngliche Farben des Fotos zeigen',
  previewWaiting: 'Die Vorschau wird gerade berechnet',
};
