// A cube of 36 vertices, scaled, rotated and translated.
layout(location = 0) in vec3 centre;
layout(location = 1) in vec3 half_extents;
layout(location = 2) in vec4 turn;
layout(location = 3) in vec4 paint;  // colour; w: pattern

flat out vec3 local_normal;
flat out vec3 normal;
flat out vec3 size;
flat out vec4 colour;
out vec3 local;
out vec3 at;

void main() {
  int face = gl_VertexID / 6;
  int corner = int[6](0, 1, 2, 2, 1, 3)[gl_VertexID % 6];
  int axis = face >> 1;
  float side = float(face & 1) * 2.0 - 1.0;
  vec2 uv = vec2(corner & 1, corner >> 1) * 2.0 - 1.0;
  vec3 unit = axis == 0 ? vec3(side, uv) : axis == 1 ? vec3(uv.y, side, uv.x) : vec3(uv, side);
  local_normal = axis == 0 ? vec3(side, 0, 0) : axis == 1 ? vec3(0, side, 0) : vec3(0, 0, side);
  normal = rotate(turn, local_normal);
  size = half_extents;
  colour = paint;
  local = unit * half_extents;
  at = centre + rotate(turn, local);
#ifdef SHADOW_PASS
  gl_Position = vec4((light * vec4(at, 1.0)).xyz * 2.0 - 1.0, 1.0);
#else
  gl_Position = view_projection * vec4(at, 1.0);
#endif
}
