// An infinite plane with a grid, by ray casting.
uniform vec4 plane;    // normal; w: height of the eye above it
uniform vec4 grid_u;   // direction in the plane; w: coordinate of the eye modulo 100 cells
uniform vec4 grid_v;
uniform vec4 surface;  // colour; w: edge of a cell in metres
in vec3 ray;
layout(location = 0) out vec4 result;

#ifdef COLOUR_PASS
float lines(vec2 cells, vec2 width, float thickness) {
  vec2 from_line = abs(fract(cells + 0.5) - 0.5);
  vec2 line = 1.0 - smoothstep(vec2(0.0), 1.5 * width + thickness, from_line);
  vec2 seen = clamp(0.35 / width, 0.0, 1.0) * line;
  return max(seen.x, seen.y);
}
#endif

void main() {
  vec3 direction = normalize(ray);
  float down = -dot(plane.xyz, direction);
  if (down <= 1e-6) discard;
  float distance = plane.w / down;
  vec3 p = direction * distance;
  gl_FragDepth = depth_of(p);
#ifdef COLOUR_PASS
  vec2 cells = (vec2(dot(grid_u.xyz, p) + grid_u.w, dot(grid_v.xyz, p) + grid_v.w)) / surface.w;
  float footprint = pixel_size(distance) / surface.w;
  vec2 width = vec2(footprint * inversesqrt(max(down, 0.01)));
  vec3 base = pow(surface.rgb, vec3(2.2));
  ivec2 tile = ivec2(floor(cells));
  float checker = ((tile.x + tile.y) & 1) == 0 ? 1.0 : 0.0;
  base *= 1.0 - 0.045 * (checker - 0.5) * clamp(0.2 / width.x, 0.0, 1.0);
  base *= 1.0 - 0.20 * lines(cells, width, 0.006);
  base *= 1.0 - 0.30 * lines(cells / 10.0, width / 10.0, 0.002);
  result = vec4(shaded(base, plane.xyz, p, 0.22, shadow.w), 1.0);
#else
  result = vec4(plane.xyz, 1.0);
#endif
}
