// The keyboard. Arrows and + - belong to the focused picture, letters to the whole page.

const ORBIT_DEGREES = 5;

const onPicture = {
  ArrowLeft: (page) => page.stage?.orbit(-ORBIT_DEGREES, 0),
  ArrowRight: (page) => page.stage?.orbit(ORBIT_DEGREES, 0),
  ArrowUp: (page) => page.stage?.orbit(0, ORBIT_DEGREES),
  ArrowDown: (page) => page.stage?.orbit(0, -ORBIT_DEGREES),
  "+": (page) => page.stage?.zoom(0.9),
  "=": (page) => page.stage?.zoom(0.9),
  "-": (page) => page.stage?.zoom(1 / 0.9),
  Home: (page) => page.stage?.lookFrom(),
  " ": (page) => page.motion.togglePlay(),
};

const anywhere = {
  p: (page) => page.motion.togglePlay(),
  b: (page) => page.motion.setShare(0),
  a: (page) => page.motion.setShare(1),
  j: (page) => page.chooseNext(1),
  k: (page) => page.chooseNext(-1),
  1: (page) => page.setColour("plain"),
  2: (page) => page.setColour("residual"),
  3: (page) => page.setColour("significance"),
  s: (page) => page.toggle("source"),
  t: (page) => page.toggle("target"),
  g: (page) => page.toggle("ghost"),
  m: (page) => page.toggle("matches"),
  d: (page) => page.theme.toggle(),
};

export function listenToKeys(canvas, page) {
  canvas.addEventListener("keydown", (event) => act(onPicture, event, page));
  document.addEventListener("keydown", (event) => act(anywhere, event, page));
}

function act(keys, event, page) {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (action === undefined) return;
  event.preventDefault();
  action(page);
}
