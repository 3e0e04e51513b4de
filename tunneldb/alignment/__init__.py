"""Design alignments: lines, arcs and clothoids in plan, grades, parabolas and circles in profile; LandXML and IFC."""
