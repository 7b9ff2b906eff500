// Block 50 x 100 mm: gmsh -2 -setnumber h 3 -format inp
DefineConstant[ h = 3 ];
SetFactory("Built-in");
Point(1) = { 0,   0, 0, h};
Point(2) = {50,   0, 0, h};
Point(3) = {50, 100, 0, h};
Point(4) = { 0, 100, 0, h};
For i In {1:4}
  Line(i) = {i, i % 4 + 1};
EndFor
Curve Loop(1) = {1:4};
Plane Surface(1) = {1};
Physical Surface("ROCK") = {1};
Mesh.Algorithm = 6;            // frontal Delaunay
Mesh.Smoothing = 10;
