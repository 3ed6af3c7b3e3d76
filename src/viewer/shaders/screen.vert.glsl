// A triangle that covers the viewport at the maximum depth.
out vec3 ray;

void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  ray = ray_z.xyz + corner.x * ray_x.xyz + corner.y * ray_y.xyz;
  gl_Position = vec4(corner, 0.9999999, 1.0);
}
