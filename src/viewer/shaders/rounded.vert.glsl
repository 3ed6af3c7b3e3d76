// The bounding box of a rounded box, as 36 vertices.
layout(location = 0) in vec3 centre;
layout(location = 1) in vec3 half_extents;
layout(location = 2) in vec4 turn;
layout(location = 3) in vec4 paint;
layout(location = 4) in float rounding;

flat out vec3 middle;
flat out vec3 core;
flat out vec4 orientation;
flat out vec4 colour;
flat out float radius;
out vec3 at;

void main() {
  int face = gl_VertexID / 6;
  int corner = int[6](0, 1, 2, 2, 1, 3)[gl_VertexID % 6];
  int axis = face >> 1;
  float side = float(face & 1) * 2.0 - 1.0;
  vec2 uv = vec2(corner & 1, corner >> 1) * 2.0 - 1.0;
  vec3 unit = axis == 0 ? vec3(side, uv) : axis == 1 ? vec3(uv.y, side, uv.x) : vec3(uv, side);
  middle = centre;
  core = half_extents - rounding;
  orientation = turn;
  colour = paint;
  radius = rounding;
  at = centre + rotate(turn, unit * half_extents);
#ifdef SHADOW_PASS
  gl_Position = vec4((light * vec4(at, 1.0)).xyz * 2.0 - 1.0, 1.0);
#else
  gl_Position = view_projection * vec4(at, 1.0);
#endif
}
