// The triangles of a mesh, rotated and translated.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 direction;  // normal; w: 1 if the triangle is one-sided
layout(location = 2) in vec3 face;       // normal of the triangle
layout(location = 3) in vec3 centre;
layout(location = 4) in vec4 turn;
layout(location = 5) in vec4 paint;  // colour; w: pattern
layout(location = 6) in vec4 grid;   // coordinates of the centre; w: edge of a cell in metres

flat out vec4 colour;
flat out float one_sided;
flat out vec3 local_normal;
flat out vec3 normal;
out vec3 smooth_normal;
out vec3 cells;
out vec3 at;

void main() {
  colour = paint;
  one_sided = direction.w;
  local_normal = face;
  normal = rotate(turn, face);
  smooth_normal = rotate(turn, direction.xyz);
  cells = (position + grid.xyz) / grid.w;
  at = centre + rotate(turn, position);
#ifdef SHADOW_PASS
  gl_Position = vec4((light * vec4(at, 1.0)).xyz * 2.0 - 1.0, 1.0);
#else
  gl_Position = view_projection * vec4(at, 1.0);
#endif
}
