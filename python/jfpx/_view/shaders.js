// Shaders of the picture: GLSL ES 3.00. Positions are relative to the origin of the scene.

const COMMON = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2DShadow;
uniform mat4 viewProjection;  // of the camera, or of the sun in the pass of shadows
uniform mat4 light;           // position -> shadow map
uniform vec3 eye;
uniform vec3 sun;
uniform vec3 up;
uniform vec4 sizes;           // extent of a pixel at distance 1; texel of the shadow map [m]; radius of the scene; cell [m]
vec3 rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
vec3 rotateBack(vec4 q, vec3 v) { return rotate(vec4(-q.xyz, q.w), v); }
`;

const SHADING = `
uniform sampler2DShadow shadowMap;
out vec4 result;

float sunlight(vec3 p, vec3 n, bool small) {
  vec3 at = (light * vec4(p + n * sizes.y * 1.8, 1.0)).xyz * 0.5 + 0.5;
  if (any(lessThan(at, vec3(0.002))) || any(greaterThan(at, vec3(0.998)))) return 1.0;
  if (small) return texture(shadowMap, vec3(at.xy, at.z - 0.0008));
  float texel = 1.0 / float(textureSize(shadowMap, 0).x), lit = 0.0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      lit += texture(shadowMap, vec3(at.xy + vec2(x, y) * 1.4 * texel, at.z - 0.0008));
    }
  }
  return lit / 9.0;
}

// Colours are of sRGB; light is computed linearly.
// Surfaces of a few pixels need fewer samples of the shadow map.
vec3 shaded(vec3 colour, vec3 n, vec3 p, float gloss, bool small) {
  vec3 albedo = pow(colour, vec3(2.2)), toEye = normalize(eye - p);
  float facing = dot(n, sun), lit = facing > 0.0 ? sunlight(p, n, small) : 0.0;
  vec3 ambient = mix(vec3(0.30, 0.28, 0.27), vec3(0.52, 0.55, 0.60), 0.5 + 0.5 * dot(n, up));
  vec3 c = albedo * (ambient + vec3(0.78, 0.74, 0.67) * max(facing, 0.0) * lit);
  float glint = max(dot(n, normalize(sun + toEye)), 0.0);
  float rim = pow(1.0 - max(dot(n, toEye), 0.0), 4.0);
  c += gloss * (0.22 * lit * pow(glint, 60.0) + 0.08 * rim * vec3(0.8, 0.9, 1.0));
  return pow(min(c, 1.0), vec3(1.0 / 2.2));
}
vec3 dimmed(vec3 colour, float sleeping) { return mix(colour, colour * 0.5625 + 0.047, sleeping); }
float inside(float signedDistance, float width) { return 1.0 - smoothstep(-width, width, signedDistance); }
// Lines where a coordinate is a whole number, except on faces that are parallel to them.
float lines(vec3 along, vec3 n) {
  vec3 width = max(fwidth(along), 1e-6), off = abs(fract(along + 0.5) - 0.5);
  vec3 line = 1.0 - smoothstep(vec3(0.008), 0.008 + 1.5 * width, off);
  vec3 seen = clamp(0.25 / width, 0.0, 1.0) * line * smoothstep(0.2, 0.4, 1.0 - abs(n));
  return max(seen.x, max(seen.y, seen.z));
}
`;

const INSTANCE = `
layout(location = 2) in vec3 centre;
layout(location = 3) in vec4 turn;
layout(location = 4) in float sleeping;
layout(location = 5) in vec4 size;
layout(location = 6) in vec4 paint;
`;

// Ray-cast balls: exact silhouette, depth and normal at any size, on a quad in front of each.
const BALL_VERTEX = `${INSTANCE}
flat out vec4 ball;
flat out vec4 orientation;
flat out vec4 colour;
flat out float asleep;
out vec3 at;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  float radius = size.x;
  ball = vec4(centre, radius);
  orientation = turn;
  colour = paint;
  asleep = sleeping;
#ifdef SHADOW
  vec3 side = normalize(abs(sun.y) < 0.9 ? cross(sun, vec3(0, 1, 0)) : cross(sun, vec3(1, 0, 0)));
  at = vec3(corner, 0.0);
  gl_Position = viewProjection * vec4(centre + (side * corner.x + cross(side, sun) * corner.y) * radius, 1.0);
#else
  vec3 away = centre - eye;
  float d = length(away);
  if (!(d > radius * 1.001)) {  // the eye is inside
    gl_Position = vec4(0.0, 0.0, -2.0, 1.0);
    return;
  }
  vec3 axis = away / d, side = normalize(abs(axis.y) < 0.9 ? cross(axis, vec3(0, 1, 0)) : cross(axis, vec3(1, 0, 0)));
  float halfSize = d * radius / sqrt((d - radius) * (d + radius)) + sizes.x * d;
  at = away + (side * corner.x + cross(side, axis) * corner.y) * halfSize;
  gl_Position = viewProjection * vec4(eye + at, 1.0);
#endif
}`;

const BALL_FRAGMENT = `
flat in vec4 ball;
flat in vec4 orientation;
flat in vec4 colour;
flat in float asleep;
in vec3 at;
#ifdef SHADOW
void main() {
  float rest = 1.0 - dot(at.xy, at.xy);
  if (rest < 0.0) discard;
  vec4 clip = viewProjection * vec4(ball.xyz + sun * (sqrt(rest) * ball.w), 1.0);
  // The depth of the surface: the plane of the quad passes through the centre.
  gl_FragDepth = clamp(clip.z * 0.5 + 0.5, 0.0, 1.0);
}
#else
${SHADING}
const vec3 kIvory = vec3(0.93, 0.91, 0.87);
// A pool ball seen at the point d of its unit sphere: white disks with a ring at both poles of z, and
// on every second ball white caps.
vec3 poolBall(vec3 d, vec3 base, bool striped, float width) {
  vec3 c = striped ? mix(kIvory, base, inside(abs(d.y) - 0.52, width)) : base;
  float disk = length(d.xy);
  vec3 disk_colour = mix(kIvory, base * 0.55, inside(abs(disk - 0.17) - 0.035, width));
  return mix(c, disk_colour, inside(disk - 0.36, width));
}
void main() {
  vec3 direction = normalize(at), middle = ball.xyz - eye;
  float along = dot(direction, middle), width = sizes.x * along;
  float miss = length(direction * along - middle);
  float coverage = clamp((ball.w - miss) / width + 0.5, 0.0, 1.0);
  if (coverage <= 0.0) discard;
  float inner = sqrt(max(ball.w * ball.w - miss * miss, 0.0));
  vec3 p = eye + direction * (along - inner), n = normalize(p - ball.xyz);
  vec4 clip = viewProjection * vec4(p, 1.0);
  gl_FragDepth = clamp(clip.z / clip.w * 0.5 + 0.5, 0.0, 1.0);
  int pattern = int(colour.w * 255.0 + 0.5);
  vec3 base = colour.rgb;
  if (pattern == 1 || pattern == 2) {
    float facing = max(dot(n, -direction), 0.15);
    base = poolBall(rotateBack(orientation, n), base, pattern == 2, width / (ball.w * facing));
  }
  result = vec4(dimmed(shaded(base, n, p, 1.0, ball.w < 10.0 * width), asleep), coverage);
}
#endif`;

const MODEL_VERTEX = `
layout(location = 0) in vec4 place;
layout(location = 1) in vec3 direction;
${INSTANCE}
flat out vec4 colour;
flat out float asleep;
flat out vec3 extent;
out vec3 normal;
out vec3 localNormal;
out vec3 local;
out vec3 at;
void main() {
  colour = paint;
  asleep = sleeping;
  extent = size.xyz;
  local = place.xyz * size.xyz + vec3(0.0, place.w * size.w, 0.0);
  localNormal = normalize(direction / size.xyz);
  normal = rotate(turn, localNormal);
  at = centre + rotate(turn, local);
  gl_Position = viewProjection * vec4(at, 1.0);
}`;

const MODEL_FRAGMENT = `
#ifdef SHADOW
void main() {}
#else
flat in vec4 colour;
flat in float asleep;
flat in vec3 extent;
in vec3 normal;
in vec3 localNormal;
in vec3 local;
in vec3 at;
uniform float oneSided;
${SHADING}
const vec3 kLight = vec3(0.97, 0.95, 0.91);
void main() {
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = normalize(normal) * side, m = abs(localNormal);
  int pattern = int(colour.w * 255.0 + 0.5);
  vec3 base = colour.rgb;
  vec2 uv = m.x > 0.5 ? local.yz : m.y > 0.5 ? local.xz : local.xy;
  vec2 face = m.x > 0.5 ? extent.yz : m.y > 0.5 ? extent.xz : extent.xy;
  vec2 edges = face - abs(uv);
  float edge = min(edges.x, edges.y), width = max(fwidth(edge), 1e-7);
  if (pattern == 3) {  // a crate: a frame around each face
    float frame = 0.14 * min(face.x, face.y);
    base *= mix(0.93, 1.06, inside(frame - edge, width) < 0.5 ? 1.0 : 0.0);
    base *= 1.0 - 0.28 * inside(abs(edge - frame) - 0.008 * min(face.x, face.y), width);
  } else if (pattern == 4) {
    base *= 1.0 - 0.16 * lines(local / sizes.w, localNormal);
  } else if (pattern == 5) {  // glass: visible at the edges
    float rim = 1.0 - smoothstep(0.0, 1.5 * width, edge);
    result = vec4(mix(vec3(0.75, 0.82, 0.88), vec3(0.45, 0.50, 0.56), rim), mix(0.05, 0.6, rim));
    return;
  } else if (pattern == 6) {  // quadrants about the y axis show rotation
    vec2 step = max(fwidth(local.xz), 1e-7);
    vec2 sides = clamp(local.xz / step, -1.0, 1.0);
    base = mix(base, kLight, 0.30 * (0.5 + 0.5 * sides.x * sides.y));
  }
  base *= gl_FrontFacing ? 1.0 : 1.0 - 0.4 * oneSided;
  float gloss = pattern == 6 || pattern == 0 ? 0.5 : 0.12;
  result = vec4(dimmed(shaded(base, n, at, gloss, false), asleep), 1.0);
}
#endif`;

// An infinite plane with a grid, faded out far from the scene.
const PLANE_VERTEX = `
uniform vec3 middle;
uniform vec3 across;
uniform vec3 along;
out vec3 at;
out vec2 cells;
void main() {
  vec2 corner = (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0) * sizes.z * 14.0;
  at = middle + across * corner.x + along * corner.y;
  cells = corner;
  gl_Position = viewProjection * vec4(at, 1.0);
}`;
const PLANE_FRAGMENT = `
uniform vec3 plane;
uniform vec2 shift;
in vec3 at;
in vec2 cells;
${SHADING}
float grid(vec2 p, float thickness) {
  vec2 width = max(fwidth(p), 1e-6), off = abs(fract(p + 0.5) - 0.5);
  vec2 line = 1.0 - smoothstep(vec2(0.0), 1.5 * width + thickness, off);
  vec2 seen = clamp(0.35 / width, 0.0, 1.0) * line;
  return max(seen.x, seen.y);
}
void main() {
  vec2 p = (cells + shift) / sizes.w;
  vec3 base = vec3(0.80, 0.815, 0.83);
  base *= 1.0 - 0.07 * grid(p, 0.006);
  base *= 1.0 - 0.10 * grid(p / 10.0, 0.002);
  float fade = 1.0 - smoothstep(2.5, 12.0, length(cells) / sizes.z);
  result = vec4(shaded(base, plane, at, 0.0, false), fade);
}`;

const SKY_VERTEX = `
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  gl_Position = vec4(at, 0.0, 1.0);
}`;
const SKY_FRAGMENT = `
in vec2 at;
out vec4 result;
void main() { result = vec4(mix(vec3(0.945, 0.955, 0.965), vec3(0.80, 0.86, 0.92), 0.5 + 0.5 * at.y), 1.0); }`;

export const SHADERS = {
  ball: [BALL_VERTEX, BALL_FRAGMENT], model: [MODEL_VERTEX, MODEL_FRAGMENT],
  plane: [PLANE_VERTEX, PLANE_FRAGMENT], sky: [SKY_VERTEX, SKY_FRAGMENT],
  source: (text, define) => COMMON + (define ? `#define ${define}\n` : "") + text,
};
