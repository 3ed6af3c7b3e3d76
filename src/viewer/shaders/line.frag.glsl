uniform float opacity;
in vec4 colour;
layout(location = 0) out vec4 result;

void main() { result = vec4(pow(colour.rgb, vec3(2.2)) * 1.3, colour.a * opacity); }
