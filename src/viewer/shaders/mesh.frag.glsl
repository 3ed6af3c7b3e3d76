// Triangle mesh: smooth, with lines at the edges of cells. The back of a one-sided mesh is dark.
flat in vec4 colour;
flat in float one_sided;
flat in vec3 local_normal;
flat in vec3 normal;
in vec3 smooth_normal;
in vec3 cells;
in vec3 at;
#ifndef SHADOW_PASS
layout(location = 0) out vec4 result;
#endif

#ifdef COLOUR_PASS
// Lines where a coordinate is a whole number, except on faces that are parallel to them.
float lines(vec3 along, vec3 direction, float thickness) {
  vec3 width = fwidth(along);
  vec3 from_line = abs(fract(along + 0.5) - 0.5);
  vec3 line = 1.0 - smoothstep(vec3(thickness), thickness + 1.5 * width, from_line);
  vec3 seen = clamp(0.25 / max(width, 1e-6), 0.0, 1.0) * line * smoothstep(0.2, 0.4, 1.0 - abs(direction));
  return max(seen.x, max(seen.y, seen.z));
}
#endif

void main() {
#ifndef SHADOW_PASS
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = normalize(smooth_normal) * side;
#ifdef COLOUR_PASS
  int pattern = int(colour.w * 255.0 + 0.5);
  vec3 base = pow(colour.rgb, vec3(2.2));
  if (pattern == 4) base *= 1.0 - 0.2 * lines(cells, local_normal, 0.008);
  float dark = gl_FrontFacing ? 0.0 : one_sided;
  // At the edge of a triangle that is seen from the side, `at` is extrapolated, and may be below its
  // neighbor, whose shadow must not fall on it.
  vec3 face = normal * side;
  float extrapolated = pixel_size(length(at)) / max(abs(dot(face, normalize(at))), 0.01);
  vec3 p = at + face * (0.3 * extrapolated);
  result = vec4(shaded_face(base * (1.0 - 0.4 * dark), n, face, p, 0.03 * (1.0 - dark), shadow.w), 1.0);
#else
  result = vec4(n, 1.0);
#endif
#endif
}
