// A line as a quad of constant width on the screen.
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
layout(location = 2) in vec4 paint;
layout(location = 3) in float width;  // units

out vec4 colour;

vec4 clipped(vec3 p, vec3 other) {
  float z = dot(p, ray_z.xyz), z_other = dot(other, ray_z.xyz), near = ray_z.w * 1.01;
  if (z < near && z_other > near) p = mix(p, other, (near - z) / (z_other - z));
  return view_projection * vec4(p, 1.0);
}

void main() {
  vec4 a = clipped(from, to), b = clipped(to, from);
  vec2 direction = (b.xy / b.w - a.xy / a.w) * viewport.xy;
  direction = dot(direction, direction) > 1e-8 ? normalize(direction) : vec2(1.0, 0.0);
  vec2 side = vec2(-direction.y, direction.x);
  vec4 p = (gl_VertexID & 1) == 0 ? a : b;
  float across = (gl_VertexID >> 1) == 0 ? -1.0 : 1.0;
  float along = (gl_VertexID & 1) == 0 ? -0.5 : 0.5;
  p.xy += (side * across + direction * along) * width * viewport.w / viewport.xy * p.w;
  if (a.w <= 0.0 || b.w <= 0.0) p = vec4(0.0, 0.0, -2.0, 1.0);
  colour = paint;
  gl_Position = p;
}
