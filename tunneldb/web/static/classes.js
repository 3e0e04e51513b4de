/** Classes of points, with their colours. */

const CLASSES = {
  0: ['not classified', '#77838e'], 1: ['unassigned', '#9aa5af'], 2: ['ground', '#8a6a3f'], 64: ['lining', '#4a5a68'], 65: ['niche', '#7b3fbf'],
  66: ['fixture', '#0a8f8f'], 67: ['rail', '#b3261e'], 68: ['object on the ground', '#c98a00'], 69: ['target sphere', '#d0021b'], 70: ['noise', '#b9c0c7'],
  40: ['bed', '#8a6a3f'], 41: ['water surface', '#2f7fb5'], 42: ['submerged lining', '#1c4a6e'], 43: ['object in the water', '#c98a00'],
};

/** Return the name of a class. */
export const classLabel = (code) => CLASSES[code]?.[0] ?? `class ${code}`;

/** Return the colour of a class. */
export const classColour = (code) => CLASSES[code]?.[1] ?? '#777777';
