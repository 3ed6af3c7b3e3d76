// A picture with an orbit camera and, for several frames, a slider. `mount` shows it in a page;
// `render` in a notebook, as a widget of anywidget.
import { Camera, Renderer, readScene } from "./renderer.js";

const BAR = "display:flex;gap:8px;align-items:center;font:12px sans-serif;color:#444;padding:4px 10px 4px 4px;background:#f6f7f8";

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// The frames of movie_blob().
async function readMovie(bytes, bodies) {
  const data = await inflate(bytes), size = 21 * bodies;
  if (size === 0) return [data];
  for (let i = size; i < data.length; ++i) data[i] ^= data[i - size];
  const frames = [];
  for (let at = 0; at + size <= data.length; at += size) frames.push(data.subarray(at, at + size));
  return frames;
}

class Picture {
  constructor(element, height) {
    this.root = document.createElement("div");
    this.root.style.cssText = `width:100%;height:${height};display:flex;flex-direction:column;position:relative`;
    this.canvas = document.createElement("canvas");
    this.canvas.style.cssText = "width:100%;flex:1;min-height:0;display:block;outline:none;touch-action:none;cursor:grab";
    this.canvas.tabIndex = 0;
    this.canvas.title = "Drag: turn. Right button or Shift: move. Wheel (after a click): zoom. Double click: reset.";
    this.root.append(this.canvas);
    element.append(this.root);
    this.frames = [];
    this.number = 0;
    this.start();
    this.listen();
    this.observer = new ResizeObserver(() => this.redraw());
    this.observer.observe(this.canvas);
  }

  start() {
    try {
      this.renderer = new Renderer(this.canvas);
    } catch (error) {
      this.fail(`The picture cannot be drawn: ${error.message}`);
    }
  }
  fail(text) {
    const line = document.createElement("div");
    line.style.cssText = "position:absolute;top:8px;left:8px;font:13px sans-serif;color:#a33";
    line.textContent = text;
    this.root.append(line);
  }

  setScene(bytes) {
    if (!this.renderer) return;
    this.scene = readScene(bytes);
    this.sceneBytes = bytes;
    this.renderer.set(this.scene);
    this.camera ??= new Camera(this.scene, this.aspect());
  }
  setFrame(bytes) {
    if (!this.scene || bytes.byteLength !== 21 * this.scene.bodies) return;
    this.frame = bytes;
    this.renderer.move(bytes);
    this.redraw();
  }
  async setMovie(bytes) {
    this.stop();
    this.frames = bytes.byteLength && this.scene ? await readMovie(bytes, this.scene.bodies) : [];
    if (this.frames.length > 1 && !this.slider) this.addBar();
    if (this.slider) this.slider.max = Math.max(this.frames.length - 1, 0);
    if (this.frames.length) this.seek(0);
  }

  aspect() { return Math.max(this.canvas.clientWidth, 1) / Math.max(this.canvas.clientHeight, 1); }
  redraw() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      if (!this.frame || !this.canvas.clientWidth) return;
      const ratio = window.devicePixelRatio || 1;
      const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
      if (this.canvas.width !== width || this.canvas.height !== height) {
        Object.assign(this.canvas, { width, height });
        if (!this.touched) this.camera.reset(this.scene, width / height);
      }
      this.renderer.draw(this.camera);
      this.root.dataset.drawn = Number(this.root.dataset.drawn || 0) + 1;
    });
  }

  // Frames

  addBar() {
    const bar = document.createElement("div"), button = document.createElement("button");
    bar.style.cssText = BAR;
    this.button = button;
    button.style.cssText = "width:2.6em;cursor:pointer";
    button.textContent = "\u25b6";
    button.title = "Play or pause (space)";
    button.onclick = () => (this.playing ? this.stop() : this.play());
    this.slider = Object.assign(document.createElement("input"), { type: "range", min: 0, max: 0, value: 0 });
    this.slider.style.cssText = "flex:1";
    this.slider.oninput = () => { this.stop(); this.seek(Number(this.slider.value)); };
    this.label = document.createElement("span");
    this.label.style.cssText = "min-width:9em;text-align:right;font-variant-numeric:tabular-nums";
    bar.append(button, this.slider, this.label);
    this.root.append(bar);
  }
  seek(number) {
    this.number = number;
    if (this.slider) {
      this.slider.value = number;
      this.label.textContent = `${(number * this.scene.interval).toFixed(2)} s \u00b7 ${number + 1}/${this.frames.length}`;
    }
    this.setFrame(this.frames[number]);
  }
  play() {
    if (this.number >= this.frames.length - 1) this.seek(0);
    const begin = performance.now(), first = this.number;
    this.button.textContent = "\u23f8";
    const next = (now) => {
      const number = first + Math.floor((now - begin) / 1000 / this.scene.interval);
      if (number >= this.frames.length - 1) {
        this.seek(this.frames.length - 1);
        return this.stop();
      }
      if (number !== this.number && number >= first) this.seek(number);
      this.playing = requestAnimationFrame(next);
    };
    this.playing = requestAnimationFrame(next);
  }
  stop() {
    cancelAnimationFrame(this.playing);
    this.playing = 0;
    if (this.button) this.button.textContent = "\u25b6";
  }

  // Mouse, touch, keys

  listen() {
    const canvas = this.canvas, pointers = new Map();
    const moved = (act) => {
      if (!this.camera) return;
      this.touched = true;
      act(this.camera);
      this.redraw();
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.focus({ preventScroll: true });
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, event);
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const x = event.clientX - before.clientX, y = event.clientY - before.clientY, height = canvas.clientHeight || 1;
      const other = [...pointers.values()].find((pointer) => pointer.pointerId !== event.pointerId);
      const gap = (pointer) => Math.hypot(pointer.clientX - other.clientX, pointer.clientY - other.clientY) || 1;
      pointers.set(event.pointerId, event);
      moved((camera) => {
        if (other) {
          camera.zoom(gap(before) / gap(event));
          camera.pan(x / height / 2, y / height / 2);
        } else if (event.shiftKey || event.buttons & 6) {
          camera.pan(x / height, y / height);
        } else {
          camera.orbit(x * 0.008, y * 0.008);
        }
      });
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    // Without a click before, the wheel scrolls the notebook.
    canvas.addEventListener("focus", () => (this.focused = true));
    canvas.addEventListener("blur", () => (this.focused = false));
    canvas.addEventListener("wheel", (event) => {
      if (!this.focused && !this.page && !event.ctrlKey) return;
      event.preventDefault();
      moved((camera) => camera.zoom(Math.exp(Math.max(-60, Math.min(60, event.deltaY)) * 0.003)));
    }, { passive: false });
    canvas.addEventListener("dblclick", () => {
      if (!this.camera) return;
      this.touched = false;
      this.camera.reset(this.scene, this.aspect());
      this.redraw();
    });
    canvas.addEventListener("keydown", (event) => {
      if (event.key !== " " || this.frames.length < 2) return;
      event.preventDefault();
      event.stopPropagation();
      this.button.click();
    });
    // Browsers take the context of the oldest of many pictures.
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.start();
      this.setScene(this.sceneBytes);
      this.setFrame(this.frame);
    });
  }

  free() {
    this.stop();
    this.observer.disconnect();
    this.renderer?.free();
  }
}

// Shows a picture in a page. The bytes are base64; a scene and a frame, compressed.
export async function mount(element, { scene, movie, height }) {
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const picture = new Picture(element, height);
  picture.page = true;
  picture.setScene(await inflate(bytes(scene)));
  await picture.setMovie(bytes(movie));
  return picture;
}

function render({ model, el }) {
  const bytes = (name) => {
    const value = model.get(name);
    return new Uint8Array(value.buffer ?? value, value.byteOffset ?? 0, value.byteLength);
  };
  const picture = new Picture(el, `${model.get("height")}px`);
  picture.setScene(bytes("scene"));
  picture.setFrame(bytes("frame"));
  picture.setMovie(bytes("movie"));
  const changed = {
    "change:scene": () => picture.setScene(bytes("scene")),
    "change:frame": () => picture.setFrame(bytes("frame")),
  };
  for (const [event, act] of Object.entries(changed)) model.on(event, act);
  return () => {
    for (const [event, act] of Object.entries(changed)) model.off(event, act);
    picture.free();
  };
}
export default { render };
