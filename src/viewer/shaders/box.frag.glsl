// Boxes: crates, plain boxes, walls with a line every metre, and glass.
flat in vec3 local_normal;
flat in vec3 normal;
flat in vec3 size;
flat in vec4 colour;
in vec3 local;
in vec3 at;
#ifndef SHADOW_PASS
layout(location = 0) out vec4 result;
#endif

#ifdef COLOUR_PASS
float hash(vec2 p) { return fract(sin(dot(p, vec2(127.1, 311.7))) * 43758.5453); }
float value_noise(vec2 p) {
  vec2 i = floor(p), f = fract(p);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(hash(i), hash(i + vec2(1, 0)), f.x),
             mix(hash(i + vec2(0, 1)), hash(i + vec2(1, 1)), f.x), f.y);
}
float inside(float signed_distance, float width) {
  return 1.0 - smoothstep(-width, width, signed_distance);
}
float grain(vec2 p) {
  return 0.6 * value_noise(p * vec2(26.0, 1.7)) + 0.4 * value_noise(p * vec2(61.0, 3.1));
}

// Planks in a frame with a brace, in units of half the face.
vec3 crate(vec2 uv, vec3 wood, float seed) {
  float width = max(fwidth(uv.x), fwidth(uv.y));
  vec2 edge = 1.0 - abs(uv);
  float plank = floor((uv.x * 0.5 + 0.5) * 5.0);
  float groove = abs(fract((uv.x * 0.5 + 0.5) * 5.0 + 0.5) - 0.5) / 2.5;
  float tone = 0.80 + 0.20 * hash(vec2(plank, seed));
  vec3 c = wood * tone * (0.82 + 0.36 * grain(vec2(uv.x + plank, uv.y) * 0.5 + seed));
  c *= mix(1.0, 0.35, inside(groove - 0.012, width));
  float brace = abs(uv.x - uv.y) * 0.7071;
  vec3 board = wood * 1.12 * (0.82 + 0.36 * grain(vec2(uv.x - uv.y, uv.x + uv.y) * 0.4 + seed));
  c *= mix(1.0, 0.55, inside(brace - 0.155, width + 0.02));
  c = mix(c, board, inside(brace - 0.13, width));
  float frame = min(edge.x, edge.y);
  bool upright = edge.x < edge.y;
  vec3 rail = wood * 1.18 * (0.82 + 0.36 * grain((upright ? uv : uv.yx) * 0.5 + seed + 3.0));
  c *= mix(1.0, 0.5, inside(frame - 0.225, width + 0.02));
  c = mix(c, rail, inside(frame - 0.20, width));
  c *= mix(1.0, 0.6, inside(abs(edge.x - edge.y) - 0.006, width) * inside(frame - 0.20, width));
  vec2 nail = abs(uv) - vec2(0.90, 0.90);
  c = mix(c, vec3(0.05), inside(length(nail) - 0.022, width));
  return c;
}

vec3 wall(vec2 metres, vec3 base) {
  vec2 width = fwidth(metres);
  vec2 from_line = abs(fract(metres + 0.5) - 0.5);
  vec2 line = 1.0 - smoothstep(vec2(0.008), vec2(0.008) + 1.5 * width, from_line);
  float fade = clamp(0.25 / max(width.x, width.y), 0.0, 1.0);
  return base * (1.0 - 0.16 * fade * max(line.x, line.y));
}
#endif

void main() {
#ifdef COLOUR_PASS
  int pattern = int(colour.w * 255.0 + 0.5);
  vec3 base = pow(colour.rgb, vec3(2.2));
  vec3 n = abs(local_normal);
  vec2 uv = n.x > 0.5 ? local.zy : n.y > 0.5 ? local.xz : local.xy;
  vec2 face = n.x > 0.5 ? size.zy : n.y > 0.5 ? size.xz : size.xy;
  float seed = dot(local_normal, vec3(1.3, 2.7, 4.1));
  if (pattern == 5) {  // glass: transparent in the middle, visible at the edges
    vec2 edge = face - abs(uv);
    float width = pixel_size(length(at)) * 1.2;
    float rim = 1.0 - smoothstep(width, 2.0 * width, min(edge.x, edge.y));
    float grazing = 1.0 - abs(dot(normalize(at), normal));
    vec3 mirrored = sky(reflect(normalize(at), normal));
    result = vec4(mix(mirrored, vec3(0.95), rim), mix(0.02 + 0.10 * pow(grazing, 5.0), 0.5, rim));
    return;
  }
  if (pattern == 3) base = crate(uv / face, base, seed);
  if (pattern == 4) base = wall(uv, base);
  result = vec4(shaded(base, normal, at, pattern == 0 ? 0.5 : 0.12, shadow.w), 1.0);
#elif !defined(SHADOW_PASS)
  result = vec4(normal, 1.0);
#endif
}
