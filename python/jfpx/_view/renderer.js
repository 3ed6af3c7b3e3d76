// Draws a scene of blob.py by WebGL 2: one draw call for each group of equal solids.
import { SHADERS } from "./shaders.js";

const FOV = 0.72;
const SHADOW_SIZE = 2048;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const add = (a, b, s = 1) => [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s];
const unit = (a) => a.map((x) => x / Math.hypot(...a));

// Rows to columns: the matrix that maps p to (r . (p - e), u . (p - e), -f . (p - e)).
function viewMatrix(eye, right, up, forward) {
  return [right[0], up[0], -forward[0], 0, right[1], up[1], -forward[1], 0, right[2], up[2], -forward[2], 0,
          -dot(right, eye), -dot(up, eye), dot(forward, eye), 1];
}
function product(a, b) {
  const c = new Float32Array(16);
  for (let i = 0; i < 4; ++i) {
    for (let k = 0; k < 4; ++k) {
      for (let m = 0; m < 4; ++m) c[4 * i + k] += a[4 * m + k] * b[4 * i + m];
    }
  }
  return c;
}

// Reads the bytes of a scene: the header, and the arrays that it names.
export function readScene(bytes) {
  const buffer = bytes.slice().buffer;  // arrays of numbers need an offset that is a multiple of 4
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const types = { Float32Array, Uint32Array, Uint8Array };
  const array = (place) => place && new types[place[0]](buffer, 4 + length + place[1], place[2]);
  header.balls = array(header.balls);
  for (const group of header.groups) {
    for (const key of ["bodies", "sizes", "paints", "poses", "vertices", "indices"]) group[key] = array(group[key]);
  }
  return header;
}

// An orbit camera. Angles are about the up axis of the scene.
export class Camera {
  constructor(scene, aspect) {
    this.up = scene.up;
    this.right0 = Math.abs(this.up[0]) > 0.9 ? [0, 1, 0] : [1, 0, 0];
    this.front0 = cross(this.right0, this.up);
    this.reset(scene, aspect);
  }
  // From the front, the right and above, as near as all balls are in the picture.
  reset(scene, aspect) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity], b = scene.balls;
    for (let i = 0; i < b.length; i += 4) {
      for (let k = 0; k < 3; ++k) {
        low[k] = Math.min(low[k], b[i + k] - b[i + 3]);
        high[k] = Math.max(high[k], b[i + k] + b[i + 3]);
      }
    }
    const empty = !(b.length > 0);
    this.target = empty ? [0, 0, 0] : low.map((x, k) => (x + high[k]) / 2);
    this.radius = empty ? 4 : Math.max(Math.hypot(...low.map((x, k) => high[k] - x)) / 2, 1e-6);
    this.centre = this.target;
    this.yaw = Math.atan2(0.55, 0.95);
    this.pitch = Math.asin(scene.height / Math.hypot(0.55, scene.height, 0.95));
    const { right, up, forward } = this.axes(), tall = Math.tan(FOV / 2), wide = tall * aspect;
    let needed = empty ? this.radius / Math.sin(FOV / 2) : this.radius / 4;
    // A ball is in the picture if it is on the inner side of the four planes through the eye.
    for (let i = 0; i < b.length; i += 4) {
      const p = add([b[i], b[i + 1], b[i + 2]], this.target, -1), r = b[i + 3];
      const x = (Math.abs(dot(p, right)) + r * Math.hypot(1, wide)) / wide;
      const y = (Math.abs(dot(p, up)) + r * Math.hypot(1, tall)) / tall;
      needed = Math.max(needed, Math.max(x, y) - dot(p, forward));
    }
    this.distance = needed * 1.08;
  }
  axes() {
    const c = Math.cos(this.pitch), s = Math.sin(this.pitch);
    const level = add(this.front0.map((x) => x * Math.cos(this.yaw)), this.right0, Math.sin(this.yaw));
    const forward = add(level.map((x) => -x * c), this.up, -s);
    const right = unit(cross(forward, this.up));
    return { right, up: cross(right, forward), forward };
  }
  orbit(x, y) {
    this.yaw -= x;
    this.pitch = Math.min(Math.max(this.pitch + y, -1.54), 1.54);
  }
  zoom(factor) { this.distance = Math.min(Math.max(this.distance * factor, this.radius * 1e-3), this.radius * 1e3); }
  // Moves by shares of the height of the picture.
  pan(x, y) {
    const { right, up } = this.axes(), height = 2 * Math.tan(FOV / 2) * this.distance;
    this.target = add(add(this.target, right, -x * height), up, y * height);
  }
  view(aspect) {
    const axes = this.axes(), eye = add(this.target, axes.forward, -this.distance);
    const away = Math.hypot(...add(eye, this.centre, -1)), far = (away + this.radius) * 20;
    const near = Math.max((away - this.radius) * 0.1, far * 2e-4, this.distance * 1e-3), f = 1 / Math.tan(FOV / 2);
    const lens = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1,
                  0, 0, 2 * far * near / (near - far), 0];
    return { eye, matrix: product(lens, viewMatrix(eye, axes.right, axes.up, axes.forward)) };
  }
}

export class Renderer {
  constructor(canvas) {
    const gl = this.gl = canvas.getContext("webgl2", { antialias: true, alpha: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.canvas = canvas;
    this.programs = {};
    for (const name of ["ball", "model", "plane", "sky"]) {
      this.programs[name] = this.#program(SHADERS[name], "");
      if (name === "ball" || name === "model") this.programs[name + "Shadow"] = this.#program(SHADERS[name], "SHADOW");
    }
    this.shadowMap = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.shadowMap);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
    for (const [key, value] of [["COMPARE_MODE", "COMPARE_REF_TO_TEXTURE"], ["COMPARE_FUNC", "LEQUAL"],
      ["MIN_FILTER", "LINEAR"], ["MAG_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]]) {
      gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + key], gl[value]);
    }
    this.shadowTarget = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowTarget);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.shadowMap, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.groups = [];
    this.empty = gl.createVertexArray();
  }

  #program([vertex, fragment], define) {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, SHADERS.source(text, define));
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
        throw new Error(gl.getShaderInfoLog(shader));
      }
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(gl.getProgramInfoLog(program));
    }
    const places = {};
    return { program, at: (name) => (places[name] ??= gl.getUniformLocation(program, name)) };
  }

  // Replaces the scene by one of readScene().
  set(scene) {
    const gl = this.gl;
    for (const group of this.groups) {
      group.buffers.forEach((buffer) => gl.deleteBuffer(buffer));
      gl.deleteVertexArray(group.array);
    }
    this.scene = scene;
    this.groups = scene.groups.map((group) => this.#upload(group));
    this.cell = 10 ** Math.round(Math.log10(Math.max(scene.bodySize, 1e-6) * 2));
  }

  #upload(group) {
    const gl = this.gl, array = gl.createVertexArray(), buffers = [];
    gl.bindVertexArray(array);
    const fill = (data, target = gl.ARRAY_BUFFER, usage = gl.STATIC_DRAW) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(target, buffer);
      gl.bufferData(target, data, usage);
      buffers.push(buffer);
      return buffer;
    };
    const attribute = (index, count, stride, offset, each, type = gl.FLOAT) => {
      gl.enableVertexAttribArray(index);
      gl.vertexAttribPointer(index, count, type, type !== gl.FLOAT, stride, offset);
      gl.vertexAttribDivisor(index, each);
    };
    if (group.vertices) {
      fill(group.vertices);
      attribute(0, 4, 28, 0, 0);
      attribute(1, 3, 28, 16, 0);
      fill(group.indices, gl.ELEMENT_ARRAY_BUFFER);
    }
    const poses = new Float32Array(8 * group.count), moving = fill(poses, gl.ARRAY_BUFFER, gl.DYNAMIC_DRAW);
    attribute(2, 3, 32, 0, 1);
    attribute(3, 4, 32, 12, 1);
    attribute(4, 1, 32, 28, 1);
    fill(group.sizes);
    attribute(5, 4, 16, 0, 1);
    fill(group.paints);
    attribute(6, 4, 4, 0, 1, gl.UNSIGNED_BYTE);
    gl.bindVertexArray(null);
    return { ...group, array, buffers, moving, places: poses };
  }

  // Moves the bodies to the poses of a frame of blob.py.
  move(bytes) {
    const gl = this.gl, n = this.scene.bodies, copy = bytes.slice().buffer;
    const positions = new Float32Array(copy, 0, 3 * n), turns = new Int16Array(copy, 12 * n, 4 * n);
    const awake = new Uint8Array(copy, 20 * n, n);
    for (const group of this.groups) {
      for (let i = 0, at = 0; i < group.count; ++i, at += 8) {
        const body = group.bodies[i], out = group.places;
        let px = 0, py = 0, pz = 0, x = 0, y = 0, z = 0, w = 1;
        if (body < n) {  // others are fixed
          px = positions[3 * body]; py = positions[3 * body + 1]; pz = positions[3 * body + 2];
          x = turns[4 * body] / 32767; y = turns[4 * body + 1] / 32767; z = turns[4 * body + 2] / 32767;
          w = turns[4 * body + 3] / 32767;
          const scale = 1 / Math.hypot(x, y, z, w);
          x *= scale; y *= scale; z *= scale; w *= scale;
        }
        if (group.poses) {
          const [vx, vy, vz, b, c, d, e] = group.poses.subarray(7 * i, 7 * i + 7);  // b: w of the part
          const tx = y * vz - z * vy + w * vx, ty = z * vx - x * vz + w * vy, tz = x * vy - y * vx + w * vz;
          px += vx + 2 * (y * tz - z * ty);
          py += vy + 2 * (z * tx - x * tz);
          pz += vz + 2 * (x * ty - y * tx);
          [x, y, z, w] = [w * c + x * b + y * e - z * d, w * d - x * e + y * b + z * c, w * e + x * d - y * c + z * b,
                          w * b - x * c - y * d - z * e];
        }
        out[at] = px; out[at + 1] = py; out[at + 2] = pz;
        out[at + 3] = x; out[at + 4] = y; out[at + 5] = z; out[at + 6] = w;
        out[at + 7] = body < n && awake[body] === 0 ? 1 : 0;
      }
      gl.bindBuffer(gl.ARRAY_BUFFER, group.moving);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, group.places);
    }
  }

  // Uniforms of all programs.
  #use(name, matrix, frame) {
    const gl = this.gl, p = this.programs[name];
    gl.useProgram(p.program);
    gl.uniformMatrix4fv(p.at("viewProjection"), false, matrix);
    gl.uniformMatrix4fv(p.at("light"), false, frame.light);
    gl.uniform3fv(p.at("eye"), frame.eye);
    gl.uniform3fv(p.at("sun"), frame.sun);
    gl.uniform3fv(p.at("up"), this.scene.up);
    gl.uniform4f(p.at("sizes"), frame.pixel, frame.texel, frame.radius, this.cell);
    gl.uniform1i(p.at("shadowMap"), 0);
    return p;
  }

  #drawGroups(matrix, frame, pass) {
    const gl = this.gl;
    for (const group of this.groups) {
      if ((group.glass ?? false) !== (pass === "glass")) continue;
      const p = this.#use((group.vertices ? "model" : "ball") + (pass === "shadow" ? "Shadow" : ""), matrix, frame);
      gl.uniform1f(p.at("oneSided"), group.oneSided ? 1 : 0);
      gl.bindVertexArray(group.array);
      if (group.vertices) {
        gl.drawElementsInstanced(gl.TRIANGLES, group.indices.length, gl.UNSIGNED_INT, 0, group.count);
      } else {
        if (pass !== "shadow") gl.enable(gl.SAMPLE_ALPHA_TO_COVERAGE);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, group.count);
        gl.disable(gl.SAMPLE_ALPHA_TO_COVERAGE);
      }
    }
  }

  // Draws the scene as a camera sees it.
  draw(camera) {
    const gl = this.gl, { width, height } = this.canvas, { eye, matrix } = camera.view(width / height);
    const radius = camera.radius, reach = radius * 1.6;
    const sun = unit(add(add(this.scene.up.map((x) => x * 0.9), camera.right0, -0.42), camera.front0, 0.32));
    const side = unit(cross(camera.right0, sun)), across = cross(sun, side);
    const box = [1 / reach, 0, 0, 0, 0, 1 / reach, 0, 0, 0, 0, -1 / (2 * reach), 0, 0, 0, 0, 1];
    const light = product(box, viewMatrix(camera.centre, across, side, sun.map((x) => -x)));
    const frame = { eye, sun, light, radius, pixel: 2 * Math.tan(FOV / 2) / height, texel: 2 * reach / SHADOW_SIZE };

    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowTarget);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.bindTexture(gl.TEXTURE_2D, null);
    this.#drawGroups(light, frame, "shadow");

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bindTexture(gl.TEXTURE_2D, this.shadowMap);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.empty);
    this.#use("sky", matrix, frame);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.enable(gl.DEPTH_TEST);
    this.#drawGroups(matrix, frame, "solid");

    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.bindVertexArray(this.empty);
    for (const plane of this.scene.planes) this.#drawPlane(plane, matrix, frame, camera);
    gl.depthMask(false);
    this.#drawGroups(matrix, frame, "glass");
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  // A plane is seen from its front alone.
  #drawPlane([x, y, z, offset], matrix, frame, camera) {
    const gl = this.gl, n = [x, y, z];
    if (dot(n, frame.eye) <= offset) return;
    const p = this.#use("plane", matrix, frame);
    const across = Math.abs(dot(n, camera.right0)) > 0.9 ? unit(cross(camera.front0, n)) : unit(cross(n, camera.front0));
    const along = cross(across, n), middle = add(camera.centre, n, offset - dot(n, camera.centre));
    const period = 10 * this.cell, origin = add(middle, this.scene.origin);
    gl.uniform3fv(p.at("plane"), n);
    gl.uniform3fv(p.at("middle"), middle);
    gl.uniform3fv(p.at("across"), across);
    gl.uniform3fv(p.at("along"), along);
    gl.uniform2f(p.at("shift"), dot(origin, across) % period, dot(origin, along) % period);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  free() { this.gl.getExtension("WEBGL_lose_context")?.loseContext(); }
}
